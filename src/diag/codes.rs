//! The code of every message, with what `overcoat explain` says about it.

/// A code.
#[derive(Clone, Copy, Debug)]
pub struct Code {
    /// `E` for errors, `W` for warnings, and four digits: 01 text, 02 names and types, 03 closures, 04 parameters, 05
    /// advice, 07 energy.
    pub code: &'static str,
    /// What it stands for.
    pub title: &'static str,
    /// What to know about it.
    pub text: &'static str,
}

const fn code(code: &'static str, title: &'static str, text: &'static str) -> Code {
    Code { code, title, text }
}

/// Every code a message may carry.
pub const CODES: &[Code] = &[
    code(
        "E0101",
        "a comment or a string does not end",
        "A comment that begins with `/*` goes on to the next `*/`; a string ends at the next `\"` on the same line. Write a line\n\
         break in a string as `\\n`, a quote as `\\\"`.",
    ),
    code(
        "E0102",
        "a bracket has no partner",
        "Every `(`, `[` and `{` needs its partner, in order. The message shows the bracket that is still open where another\n\
         one closes.",
    ),
    code(
        "E0103",
        "an `#include` names an unknown header",
        "`#include` takes a name in quotes or angle brackets. stdosl.h and its kin are built in. Other files are looked for\n\
         beside the file that includes them and in the include directories: `-I DIR`, or `Engine::includes`.",
    ),
    code(
        "E0104",
        "a preprocessor directive is not supported",
        "A line that begins with `#` is for the preprocessor, which knows `include`, `define`, `undef`, `if`, `ifdef`, `ifndef`,\n\
         `elif`, `else`, `endif`, `pragma`, `error`, `warning` and `line`. Every `#if` needs an `#endif` in the same file.",
    ),
    code(
        "E0105",
        "nested deeper than 256 levels",
        "Brackets, signs in front of values, `? :`, blocks and `else if` may nest 256 deep, all together. Give parts of the\n\
         expression names of their own.",
    ),
    code(
        "E0106",
        "a character that cannot stand in a script",
        "Scripts are written in ASCII outside comments and strings. Quotes, dashes and multiplication signs from a word\n\
         processor look right and are other characters.",
    ),
    code(
        "E0107",
        "the text does not follow the grammar",
        "The text does not follow the grammar. The message shows where reading stopped and what could have stood there; often\n\
         a `;` or a bracket is missing just before.",
    ),
    code(
        "E0108",
        "a number does not fit its type",
        "Ints have 32 bits, -2147483648 to 2147483647; floats reach 3.4e38. A number with a point or an exponent is a float.",
    ),
    code(
        "E0109",
        "a part of the language that is not supported",
        "OSL has it, but it does not run here; the message names it and says why. docs/language.md lists what does.",
    ),
    code("E0110", "the script is too large", "A script may have 64 MiB unless the host sets `Limits::script_bytes`."),
    code(
        "E0111",
        "a macro cannot be replaced",
        "A macro was given the wrong number of arguments, its parentheses do not close, or macros expand without end: what\n\
         they expand to, intermediate results counted, may come to `Limits::expanded_bytes`.",
    ),
    code(
        "E0112",
        "`#include` goes too deep",
        "Files include each other, or too many of them: `Limits::include_depth` deep, `Limits::expanded_bytes` together. A\n\
         `#pragma once` or an `#ifndef` around a header lets it in only once.",
    ),
    code(
        "E0201",
        "an unknown name",
        "Nothing of that name is declared before this place. Variables live until the end of their block; functions see their\n\
         parameters, not the variables of the shader.",
    ),
    code(
        "E0202",
        "a name is declared twice",
        "A block can declare a name once. Parameters of a shader cannot have the names of globals such as `P` or `u`.",
    ),
    code(
        "E0203",
        "a value has the wrong type",
        "Ints become floats, numbers become colors and vectors, points, vectors and normals become each other without being\n\
         asked. Anything else is written as a cast, `(color) x`, or a component is taken, `x[0]`.",
    ),
    code(
        "E0204",
        "an operator does not take these types",
        "The operator does not take values of these types. `%` and the bit operators are for ints, `<` and its kin for single\n\
         numbers. For structs a function `__operator__add__` and so on says what the operator does.",
    ),
    code(
        "E0205",
        "a function does not take these arguments",
        "There is a function of that name, but none that takes these arguments. The help lists those there are.",
    ),
    code(
        "E0206",
        "an unknown function",
        "There is no function or closure of that name: in the script, among those of OSL, or brought by the host.",
    ),
    code(
        "E0207",
        "something that cannot be assigned to",
        "Parameters that are not `output` and the globals other than `Ci` can be read only. Copy them to a variable.",
    ),
    code(
        "E0208",
        "a component that the value does not have",
        "Colors have `.r .g .b`, other triples `.x .y .z`, all `[0]` to `[2]`; matrices `[0..3][0..3]`; arrays as many elements\n\
         as they were declared with; structs their fields. An index that is only known while shading is limited to what there\n\
         is.",
    ),
    code(
        "E0209",
        "a condition that is no number",
        "`if`, `? :`, `&&` and loops ask whether a number differs from 0. Strings and closures are compared first.",
    ),
    code(
        "E0210",
        "a function calls itself",
        "Functions are written out where they are called, so none can call itself, not even by way of another. Use a loop.",
    ),
    code("E0211", "`break` or `continue` outside a loop", "`break` and `continue` stand in loops."),
    code(
        "E0212",
        "the script is too large with its calls written out",
        "Calls are written out, so functions that call functions that call functions grow quickly. `Limits::calls` and\n\
         `Limits::expressions` set how far; arrays may have 65536 parts.",
    ),
    code(
        "E0301",
        "closures are added and scaled, nothing else",
        "A closure is no number: closures are added to each other, scaled by colors or numbers, and laid over each other with\n\
         `layer(top, base)`. What would be a difference could be negative.",
    ),
    code(
        "E0302",
        "an unknown keyword argument of a closure",
        "After its arguments in order a closure takes pairs of a name in quotes and a value. `overcoat lobes NAME` lists the\n\
         names.",
    ),
    code("E0303", "an unknown option", "This argument is one of a few words. The message lists them."),
    code(
        "E0304",
        "a keyword argument is given twice or without a value",
        "Keyword arguments come in pairs, `\"name\", value`, each name once.",
    ),
    code(
        "E0305",
        "a closure that was left out of this build",
        "Closures come in families, and whoever builds overcoat into a program may leave some out. The message names the cargo\n\
         feature that brings this one: `cloth` sheens and threads, `microfacet` rough and smooth surfaces, `legacy` the\n\
         highlights of old, phong and ward.",
    ),
    code(
        "E0401",
        "an unknown parameter",
        "The shader has no parameter of that name. Parts of a struct are set as `s.x`, elements of an array as `a[0]`.",
    ),
    code(
        "E0402",
        "a value does not fit a parameter",
        "The value given for a parameter is of another type than the parameter.",
    ),
    code(
        "E0701",
        "the material gains energy",
        "For some parameters and some direction the material reflects more light than it receives. The message shows them.\n\
         Scale the weights so that they add up to at most 1, or use `layer` in place of a sum.",
    ),
    code(
        "W0501",
        "`Ci` is never assigned",
        "No statement assigns `Ci`, and no `output closure color` parameter takes its place.",
    ),
    code(
        "W0502",
        "a statement without effect",
        "The value of this statement is not used, so it does nothing. To add a closure to the material write `Ci += …`.",
    ),
    code(
        "W0503",
        "a parameter lies outside its declared range",
        "The value lies outside the `min` and `max` of the parameter's metadata. It is used as it is.",
    ),
    code(
        "W0504",
        "the top of a layer transmits",
        "Light that the top of a layer lets through counts as spent: the base below gets nothing of it.",
    ),
    code(
        "W0505",
        "the preprocessor has something to say",
        "`#warning`, or a macro that is defined twice in different ways.",
    ),
    code(
        "W0506",
        "a function is not quite what its name says",
        "The function runs, but not quite as its name says: derivatives are zero where the\n\
         host gives none.",
    ),
    code(
        "W0507",
        "a closure is not quite what its name says",
        "Another renderer means something else by this name. The message says what differs; `overcoat lobes NAME` shows what\n\
         the closure becomes.",
    ),
    code(
        "W0508",
        "an argument of a closure has no effect",
        "Other renderers read the argument; here it is accepted and changes nothing. The message says why.",
    ),
    code(
        "W0702",
        "whether the material gains energy could not be decided",
        "The proof came to no end within its effort, or met something it does not follow. That the material gains is neither\n\
         shown nor ruled out.",
    ),
    code(
        "W0703",
        "a weight can be negative",
        "A weight may become negative for some parameters. Negative weights count as 0, so the closure vanishes there.",
    ),
];
