// A color with an opacity, part by part.
#pragma once
#ifndef OVERCOAT_COLOR4_H
#define OVERCOAT_COLOR4_H

struct color4 {
    color rgb;
    float a;
};

color4 __operator__add__(color4 a, color4 b) { return color4(a.rgb + b.rgb, a.a + b.a); }
color4 __operator__add__(color4 a, float b) { return color4(a.rgb + b, a.a + b); }
color4 __operator__add__(float a, color4 b) { return color4(a + b.rgb, a + b.a); }
color4 __operator__sub__(color4 a, color4 b) { return color4(a.rgb - b.rgb, a.a - b.a); }
color4 __operator__sub__(color4 a, float b) { return color4(a.rgb - b, a.a - b); }
color4 __operator__sub__(float a, color4 b) { return color4(a - b.rgb, a - b.a); }
color4 __operator__mul__(color4 a, color4 b) { return color4(a.rgb * b.rgb, a.a * b.a); }
color4 __operator__mul__(color4 a, float b) { return color4(a.rgb * b, a.a * b); }
color4 __operator__mul__(float a, color4 b) { return color4(a * b.rgb, a * b.a); }
color4 __operator__div__(color4 a, color4 b) { return color4(a.rgb / b.rgb, a.a / b.a); }
color4 __operator__div__(color4 a, float b) { return color4(a.rgb / b, a.a / b); }
color4 __operator__div__(float a, color4 b) { return color4(a / b.rgb, a / b.a); }
color4 __operator__neg__(color4 a) { return color4(-a.rgb, -a.a); }
int __operator__eq__(color4 a, color4 b) { return a.rgb == b.rgb && a.a == b.a; }
int __operator__ne__(color4 a, color4 b) { return !(a.rgb == b.rgb && a.a == b.a); }

color4 abs(color4 a) { return color4(abs(a.rgb), abs(a.a)); }
color4 ceil(color4 a) { return color4(ceil(a.rgb), ceil(a.a)); }
color4 floor(color4 a) { return color4(floor(a.rgb), floor(a.a)); }
color4 round(color4 a) { return color4(round(a.rgb), round(a.a)); }
color4 sqrt(color4 a) { return color4(sqrt(a.rgb), sqrt(a.a)); }
color4 exp(color4 a) { return color4(exp(a.rgb), exp(a.a)); }
color4 log(color4 a) { return color4(log(a.rgb), log(a.a)); }
color4 sin(color4 a) { return color4(sin(a.rgb), sin(a.a)); }
color4 cos(color4 a) { return color4(cos(a.rgb), cos(a.a)); }
color4 sign(color4 a) { return color4(sign(a.rgb), sign(a.a)); }
color4 min(color4 a, color4 b) { return color4(min(a.rgb, b.rgb), min(a.a, b.a)); }
color4 min(color4 a, float b) { return color4(min(a.rgb, b), min(a.a, b)); }
color4 max(color4 a, color4 b) { return color4(max(a.rgb, b.rgb), max(a.a, b.a)); }
color4 max(color4 a, float b) { return color4(max(a.rgb, b), max(a.a, b)); }
color4 mod(color4 a, color4 b) { return color4(mod(a.rgb, b.rgb), mod(a.a, b.a)); }
color4 mod(color4 a, float b) { return color4(mod(a.rgb, b), mod(a.a, b)); }
color4 fmod(color4 a, color4 b) { return color4(fmod(a.rgb, b.rgb), fmod(a.a, b.a)); }
color4 fmod(color4 a, float b) { return color4(fmod(a.rgb, b), fmod(a.a, b)); }
color4 pow(color4 a, color4 b) { return color4(pow(a.rgb, b.rgb), pow(a.a, b.a)); }
color4 pow(color4 a, float b) { return color4(pow(a.rgb, b), pow(a.a, b)); }
color4 step(color4 a, color4 b) { return color4(step(a.rgb, b.rgb), step(a.a, b.a)); }
color4 step(color4 a, float b) { return color4(step(a.rgb, b), step(a.a, b)); }
color4 clamp(color4 a, color4 b, color4 c) { return color4(clamp(a.rgb, b.rgb, c.rgb), clamp(a.a, b.a, c.a)); }
color4 clamp(color4 a, float b, float c) { return color4(clamp(a.rgb, b, c), clamp(a.a, b, c)); }
color4 smoothstep(color4 a, color4 b, color4 c) { return color4(smoothstep(a.rgb, b.rgb, c.rgb), smoothstep(a.a, b.a, c.a)); }
color4 smoothstep(color4 a, float b, float c) { return color4(smoothstep(a.rgb, b, c), smoothstep(a.a, b, c)); }
color4 mix(color4 a, color4 b, color4 x) { return color4(mix(a.rgb, b.rgb, x.rgb), mix(a.a, b.a, x.a)); }
color4 mix(color4 a, color4 b, float x) { return color4(mix(a.rgb, b.rgb, x), mix(a.a, b.a, x)); }
#endif
