// Four floats, part by part.
#pragma once
#ifndef OVERCOAT_VECTOR4_H
#define OVERCOAT_VECTOR4_H

struct vector4 {
    float x;
    float y;
    float z;
    float w;
};

vector4 __operator__add__(vector4 a, vector4 b) { return vector4(a.x + b.x, a.y + b.y, a.z + b.z, a.w + b.w); }
vector4 __operator__add__(vector4 a, float b) { return vector4(a.x + b, a.y + b, a.z + b, a.w + b); }
vector4 __operator__add__(float a, vector4 b) { return vector4(a + b.x, a + b.y, a + b.z, a + b.w); }
vector4 __operator__sub__(vector4 a, vector4 b) { return vector4(a.x - b.x, a.y - b.y, a.z - b.z, a.w - b.w); }
vector4 __operator__sub__(vector4 a, float b) { return vector4(a.x - b, a.y - b, a.z - b, a.w - b); }
vector4 __operator__sub__(float a, vector4 b) { return vector4(a - b.x, a - b.y, a - b.z, a - b.w); }
vector4 __operator__mul__(vector4 a, vector4 b) { return vector4(a.x * b.x, a.y * b.y, a.z * b.z, a.w * b.w); }
vector4 __operator__mul__(vector4 a, float b) { return vector4(a.x * b, a.y * b, a.z * b, a.w * b); }
vector4 __operator__mul__(float a, vector4 b) { return vector4(a * b.x, a * b.y, a * b.z, a * b.w); }
vector4 __operator__div__(vector4 a, vector4 b) { return vector4(a.x / b.x, a.y / b.y, a.z / b.z, a.w / b.w); }
vector4 __operator__div__(vector4 a, float b) { return vector4(a.x / b, a.y / b, a.z / b, a.w / b); }
vector4 __operator__div__(float a, vector4 b) { return vector4(a / b.x, a / b.y, a / b.z, a / b.w); }
vector4 __operator__neg__(vector4 a) { return vector4(-a.x, -a.y, -a.z, -a.w); }
int __operator__eq__(vector4 a, vector4 b) { return a.x == b.x && a.y == b.y && a.z == b.z && a.w == b.w; }
int __operator__ne__(vector4 a, vector4 b) { return !(a.x == b.x && a.y == b.y && a.z == b.z && a.w == b.w); }

vector4 abs(vector4 a) { return vector4(abs(a.x), abs(a.y), abs(a.z), abs(a.w)); }
vector4 ceil(vector4 a) { return vector4(ceil(a.x), ceil(a.y), ceil(a.z), ceil(a.w)); }
vector4 floor(vector4 a) { return vector4(floor(a.x), floor(a.y), floor(a.z), floor(a.w)); }
vector4 round(vector4 a) { return vector4(round(a.x), round(a.y), round(a.z), round(a.w)); }
vector4 sqrt(vector4 a) { return vector4(sqrt(a.x), sqrt(a.y), sqrt(a.z), sqrt(a.w)); }
vector4 exp(vector4 a) { return vector4(exp(a.x), exp(a.y), exp(a.z), exp(a.w)); }
vector4 log(vector4 a) { return vector4(log(a.x), log(a.y), log(a.z), log(a.w)); }
vector4 sin(vector4 a) { return vector4(sin(a.x), sin(a.y), sin(a.z), sin(a.w)); }
vector4 cos(vector4 a) { return vector4(cos(a.x), cos(a.y), cos(a.z), cos(a.w)); }
vector4 sign(vector4 a) { return vector4(sign(a.x), sign(a.y), sign(a.z), sign(a.w)); }
vector4 min(vector4 a, vector4 b) { return vector4(min(a.x, b.x), min(a.y, b.y), min(a.z, b.z), min(a.w, b.w)); }
vector4 min(vector4 a, float b) { return vector4(min(a.x, b), min(a.y, b), min(a.z, b), min(a.w, b)); }
vector4 max(vector4 a, vector4 b) { return vector4(max(a.x, b.x), max(a.y, b.y), max(a.z, b.z), max(a.w, b.w)); }
vector4 max(vector4 a, float b) { return vector4(max(a.x, b), max(a.y, b), max(a.z, b), max(a.w, b)); }
vector4 mod(vector4 a, vector4 b) { return vector4(mod(a.x, b.x), mod(a.y, b.y), mod(a.z, b.z), mod(a.w, b.w)); }
vector4 mod(vector4 a, float b) { return vector4(mod(a.x, b), mod(a.y, b), mod(a.z, b), mod(a.w, b)); }
vector4 fmod(vector4 a, vector4 b) { return vector4(fmod(a.x, b.x), fmod(a.y, b.y), fmod(a.z, b.z), fmod(a.w, b.w)); }
vector4 fmod(vector4 a, float b) { return vector4(fmod(a.x, b), fmod(a.y, b), fmod(a.z, b), fmod(a.w, b)); }
vector4 pow(vector4 a, vector4 b) { return vector4(pow(a.x, b.x), pow(a.y, b.y), pow(a.z, b.z), pow(a.w, b.w)); }
vector4 pow(vector4 a, float b) { return vector4(pow(a.x, b), pow(a.y, b), pow(a.z, b), pow(a.w, b)); }
vector4 step(vector4 a, vector4 b) { return vector4(step(a.x, b.x), step(a.y, b.y), step(a.z, b.z), step(a.w, b.w)); }
vector4 step(vector4 a, float b) { return vector4(step(a.x, b), step(a.y, b), step(a.z, b), step(a.w, b)); }
vector4 clamp(vector4 a, vector4 b, vector4 c) { return vector4(clamp(a.x, b.x, c.x), clamp(a.y, b.y, c.y), clamp(a.z, b.z, c.z), clamp(a.w, b.w, c.w)); }
vector4 clamp(vector4 a, float b, float c) { return vector4(clamp(a.x, b, c), clamp(a.y, b, c), clamp(a.z, b, c), clamp(a.w, b, c)); }
vector4 smoothstep(vector4 a, vector4 b, vector4 c) { return vector4(smoothstep(a.x, b.x, c.x), smoothstep(a.y, b.y, c.y), smoothstep(a.z, b.z, c.z), smoothstep(a.w, b.w, c.w)); }
vector4 smoothstep(vector4 a, float b, float c) { return vector4(smoothstep(a.x, b, c), smoothstep(a.y, b, c), smoothstep(a.z, b, c), smoothstep(a.w, b, c)); }
vector4 mix(vector4 a, vector4 b, vector4 x) { return vector4(mix(a.x, b.x, x.x), mix(a.y, b.y, x.y), mix(a.z, b.z, x.z), mix(a.w, b.w, x.w)); }
vector4 mix(vector4 a, vector4 b, float x) { return vector4(mix(a.x, b.x, x), mix(a.y, b.y, x), mix(a.z, b.z, x), mix(a.w, b.w, x)); }
float dot(vector4 a, vector4 b) { return a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w; }
float length(vector4 a) { return sqrt(a.x * a.x + a.y * a.y + a.z * a.z + a.w * a.w); }
float distance(vector4 a, vector4 b) { return length(a - b); }
vector4 normalize(vector4 a) { return a / length(a); }
#endif
