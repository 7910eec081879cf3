// Pairs of floats, part by part.
#pragma once
#ifndef OVERCOAT_VECTOR2_H
#define OVERCOAT_VECTOR2_H

struct vector2 {
    float x;
    float y;
};

vector2 __operator__add__(vector2 a, vector2 b) { return vector2(a.x + b.x, a.y + b.y); }
vector2 __operator__add__(vector2 a, float b) { return vector2(a.x + b, a.y + b); }
vector2 __operator__add__(float a, vector2 b) { return vector2(a + b.x, a + b.y); }
vector2 __operator__sub__(vector2 a, vector2 b) { return vector2(a.x - b.x, a.y - b.y); }
vector2 __operator__sub__(vector2 a, float b) { return vector2(a.x - b, a.y - b); }
vector2 __operator__sub__(float a, vector2 b) { return vector2(a - b.x, a - b.y); }
vector2 __operator__mul__(vector2 a, vector2 b) { return vector2(a.x * b.x, a.y * b.y); }
vector2 __operator__mul__(vector2 a, float b) { return vector2(a.x * b, a.y * b); }
vector2 __operator__mul__(float a, vector2 b) { return vector2(a * b.x, a * b.y); }
vector2 __operator__div__(vector2 a, vector2 b) { return vector2(a.x / b.x, a.y / b.y); }
vector2 __operator__div__(vector2 a, float b) { return vector2(a.x / b, a.y / b); }
vector2 __operator__div__(float a, vector2 b) { return vector2(a / b.x, a / b.y); }
vector2 __operator__neg__(vector2 a) { return vector2(-a.x, -a.y); }
int __operator__eq__(vector2 a, vector2 b) { return a.x == b.x && a.y == b.y; }
int __operator__ne__(vector2 a, vector2 b) { return !(a.x == b.x && a.y == b.y); }

vector2 abs(vector2 a) { return vector2(abs(a.x), abs(a.y)); }
vector2 ceil(vector2 a) { return vector2(ceil(a.x), ceil(a.y)); }
vector2 floor(vector2 a) { return vector2(floor(a.x), floor(a.y)); }
vector2 round(vector2 a) { return vector2(round(a.x), round(a.y)); }
vector2 sqrt(vector2 a) { return vector2(sqrt(a.x), sqrt(a.y)); }
vector2 exp(vector2 a) { return vector2(exp(a.x), exp(a.y)); }
vector2 log(vector2 a) { return vector2(log(a.x), log(a.y)); }
vector2 sin(vector2 a) { return vector2(sin(a.x), sin(a.y)); }
vector2 cos(vector2 a) { return vector2(cos(a.x), cos(a.y)); }
vector2 sign(vector2 a) { return vector2(sign(a.x), sign(a.y)); }
vector2 min(vector2 a, vector2 b) { return vector2(min(a.x, b.x), min(a.y, b.y)); }
vector2 min(vector2 a, float b) { return vector2(min(a.x, b), min(a.y, b)); }
vector2 max(vector2 a, vector2 b) { return vector2(max(a.x, b.x), max(a.y, b.y)); }
vector2 max(vector2 a, float b) { return vector2(max(a.x, b), max(a.y, b)); }
vector2 mod(vector2 a, vector2 b) { return vector2(mod(a.x, b.x), mod(a.y, b.y)); }
vector2 mod(vector2 a, float b) { return vector2(mod(a.x, b), mod(a.y, b)); }
vector2 fmod(vector2 a, vector2 b) { return vector2(fmod(a.x, b.x), fmod(a.y, b.y)); }
vector2 fmod(vector2 a, float b) { return vector2(fmod(a.x, b), fmod(a.y, b)); }
vector2 pow(vector2 a, vector2 b) { return vector2(pow(a.x, b.x), pow(a.y, b.y)); }
vector2 pow(vector2 a, float b) { return vector2(pow(a.x, b), pow(a.y, b)); }
vector2 step(vector2 a, vector2 b) { return vector2(step(a.x, b.x), step(a.y, b.y)); }
vector2 step(vector2 a, float b) { return vector2(step(a.x, b), step(a.y, b)); }
vector2 clamp(vector2 a, vector2 b, vector2 c) { return vector2(clamp(a.x, b.x, c.x), clamp(a.y, b.y, c.y)); }
vector2 clamp(vector2 a, float b, float c) { return vector2(clamp(a.x, b, c), clamp(a.y, b, c)); }
vector2 smoothstep(vector2 a, vector2 b, vector2 c) { return vector2(smoothstep(a.x, b.x, c.x), smoothstep(a.y, b.y, c.y)); }
vector2 smoothstep(vector2 a, float b, float c) { return vector2(smoothstep(a.x, b, c), smoothstep(a.y, b, c)); }
vector2 mix(vector2 a, vector2 b, vector2 x) { return vector2(mix(a.x, b.x, x.x), mix(a.y, b.y, x.y)); }
vector2 mix(vector2 a, vector2 b, float x) { return vector2(mix(a.x, b.x, x), mix(a.y, b.y, x)); }
float dot(vector2 a, vector2 b) { return a.x * b.x + a.y * b.y; }
float length(vector2 a) { return sqrt(a.x * a.x + a.y * a.y); }
float distance(vector2 a, vector2 b) { return length(a - b); }
vector2 normalize(vector2 a) { return a / length(a); }
#endif
