// A gray with an opacity, part by part.
#pragma once
#ifndef OVERCOAT_COLOR2_H
#define OVERCOAT_COLOR2_H

struct color2 {
    float r;
    float a;
};

color2 __operator__add__(color2 a, color2 b) { return color2(a.r + b.r, a.a + b.a); }
color2 __operator__add__(color2 a, float b) { return color2(a.r + b, a.a + b); }
color2 __operator__add__(float a, color2 b) { return color2(a + b.r, a + b.a); }
color2 __operator__sub__(color2 a, color2 b) { return color2(a.r - b.r, a.a - b.a); }
color2 __operator__sub__(color2 a, float b) { return color2(a.r - b, a.a - b); }
color2 __operator__sub__(float a, color2 b) { return color2(a - b.r, a - b.a); }
color2 __operator__mul__(color2 a, color2 b) { return color2(a.r * b.r, a.a * b.a); }
color2 __operator__mul__(color2 a, float b) { return color2(a.r * b, a.a * b); }
color2 __operator__mul__(float a, color2 b) { return color2(a * b.r, a * b.a); }
color2 __operator__div__(color2 a, color2 b) { return color2(a.r / b.r, a.a / b.a); }
color2 __operator__div__(color2 a, float b) { return color2(a.r / b, a.a / b); }
color2 __operator__div__(float a, color2 b) { return color2(a / b.r, a / b.a); }
color2 __operator__neg__(color2 a) { return color2(-a.r, -a.a); }
int __operator__eq__(color2 a, color2 b) { return a.r == b.r && a.a == b.a; }
int __operator__ne__(color2 a, color2 b) { return !(a.r == b.r && a.a == b.a); }

color2 abs(color2 a) { return color2(abs(a.r), abs(a.a)); }
color2 ceil(color2 a) { return color2(ceil(a.r), ceil(a.a)); }
color2 floor(color2 a) { return color2(floor(a.r), floor(a.a)); }
color2 round(color2 a) { return color2(round(a.r), round(a.a)); }
color2 sqrt(color2 a) { return color2(sqrt(a.r), sqrt(a.a)); }
color2 exp(color2 a) { return color2(exp(a.r), exp(a.a)); }
color2 log(color2 a) { return color2(log(a.r), log(a.a)); }
color2 sin(color2 a) { return color2(sin(a.r), sin(a.a)); }
color2 cos(color2 a) { return color2(cos(a.r), cos(a.a)); }
color2 sign(color2 a) { return color2(sign(a.r), sign(a.a)); }
color2 min(color2 a, color2 b) { return color2(min(a.r, b.r), min(a.a, b.a)); }
color2 min(color2 a, float b) { return color2(min(a.r, b), min(a.a, b)); }
color2 max(color2 a, color2 b) { return color2(max(a.r, b.r), max(a.a, b.a)); }
color2 max(color2 a, float b) { return color2(max(a.r, b), max(a.a, b)); }
color2 mod(color2 a, color2 b) { return color2(mod(a.r, b.r), mod(a.a, b.a)); }
color2 mod(color2 a, float b) { return color2(mod(a.r, b), mod(a.a, b)); }
color2 fmod(color2 a, color2 b) { return color2(fmod(a.r, b.r), fmod(a.a, b.a)); }
color2 fmod(color2 a, float b) { return color2(fmod(a.r, b), fmod(a.a, b)); }
color2 pow(color2 a, color2 b) { return color2(pow(a.r, b.r), pow(a.a, b.a)); }
color2 pow(color2 a, float b) { return color2(pow(a.r, b), pow(a.a, b)); }
color2 step(color2 a, color2 b) { return color2(step(a.r, b.r), step(a.a, b.a)); }
color2 step(color2 a, float b) { return color2(step(a.r, b), step(a.a, b)); }
color2 clamp(color2 a, color2 b, color2 c) { return color2(clamp(a.r, b.r, c.r), clamp(a.a, b.a, c.a)); }
color2 clamp(color2 a, float b, float c) { return color2(clamp(a.r, b, c), clamp(a.a, b, c)); }
color2 smoothstep(color2 a, color2 b, color2 c) { return color2(smoothstep(a.r, b.r, c.r), smoothstep(a.a, b.a, c.a)); }
color2 smoothstep(color2 a, float b, float c) { return color2(smoothstep(a.r, b, c), smoothstep(a.a, b, c)); }
color2 mix(color2 a, color2 b, color2 x) { return color2(mix(a.r, b.r, x.r), mix(a.a, b.a, x.a)); }
color2 mix(color2 a, color2 b, float x) { return color2(mix(a.r, b.r, x), mix(a.a, b.a, x)); }
#endif
