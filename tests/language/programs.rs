//! Random programs of loops, functions, arrays and structs.

use proptest::prelude::*;

/// A statement over `a`, `b`, `n` and `t`, with `X` for a number known early or late.
pub fn statement() -> impl Strategy<Value = String> {
    let simple = prop::sample::select(vec![
        "a += X;",
        "b = a * 0.5;",
        "t[n % 3] = a;",
        "a = t[n % 3 + 0];",
        "n++;",
        "n += 2;",
        "a = f(a, b);",
        "g(a, n);",
        "b = n++ * X;",
        "p = p + pair(a, X);",
        "a = p.y;",
        "if (a > 4) break;",
        "if (b > a) continue;",
        "a = h(n);",
        "b = a > 1 ? f(b, a) : h(n);",
        "n = (a > 1) && (b = X);",
        "p = p * X;",
        "t[1] = p.x;",
        "a = mod(a, 7);",
    ])
    .prop_map(str::to_owned);
    simple.prop_recursive(3, 14, 4, |inner| {
        let block = prop::collection::vec(inner, 1..4).prop_map(|v| v.concat());
        prop_oneof![
            (block.clone(), 1..5).prop_map(|(b, k)| format!("for (int i = 0; i < {k}; i++) {{ {b} }}")),
            (block.clone(), 1..4).prop_map(|(b, k)| format!("{{ int w = 0; while (w < {k} + X) {{ w++; {b} }} }}")),
            (block.clone(), block.clone()).prop_map(|(b, c)| format!("if (a < X + 1) {{ {b} }} else {{ {c} }}")),
            block.prop_map(|b| format!("do {{ {b} }} while (n++ < 3);")),
        ]
    })
}

/// What those statements call.
pub const LIBRARY: &str = "struct pair { float x; float y; };
    pair __operator__add__(pair a, pair b) { return pair(a.x + b.x, a.y + b.y); }
    pair __operator__mul__(pair a, float k) { pair r = a; r.x *= k; r.y *= k; return r; }
    float f(float x, float y) { if (x > y) return x - y; return mod(x + y, 5); }
    void g(output float x, output int n) { x = mod(x * 2, 9); n = n > 20 ? 0 : n + 1; }
    float h(int n) { float s = 0; for (int i = 0; i < 6; i++) { if (i > n) return s; s += i; } return -1; }";
