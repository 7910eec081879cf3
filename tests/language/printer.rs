//! A syntax tree as text, every operation in parentheses.

use overcoat::syntax::ast::{
    Args, Ast, Declarator, ExprId, ExprKind, Length, Metadatum, Param, Root, ShaderKind, Stmt, TypeName,
};
use std::fmt::Write;

/// Structs, functions, the shader: each on a line.
pub fn print(ast: &Ast) -> String {
    let p = Printer(ast);
    let mut out = String::new();
    for s in &ast.structs {
        let fields: String = s.fields.iter().map(|(ty, d)| format!("{} {};", p.ty(*ty), p.declarator(d))).collect();
        let _ = writeln!(out, "struct {} {{{fields}}};", ast.name(s.name));
    }
    for f in &ast.functions {
        let body = f.body.as_ref().map_or(";".into(), |b| p.block(b));
        let _ = writeln!(out, "{} {}({}){body}", p.ty(f.ty), ast.name(f.name), p.params(&f.params));
    }
    if let Some(s) = &ast.shader {
        let kind = match s.kind {
            ShaderKind::Surface => "surface",
            ShaderKind::Generic => "shader",
            ShaderKind::Displacement => "displacement",
            ShaderKind::Volume => "volume",
            ShaderKind::Light => "light",
        };
        let body = p.block(&s.body);
        let _ = match s.name {
            Some(name) => {
                let metadata = p.metadata(&s.metadata);
                writeln!(out, "{kind} {}{metadata}({}){body}", ast.name(name), p.params(&s.params))
            }
            None => writeln!(out, "{}", &body[1..body.len() - 1]),
        };
    }
    out
}

struct Printer<'a>(&'a Ast);

impl Printer<'_> {
    fn ty(&self, ty: TypeName) -> String {
        match ty {
            TypeName::Closure => "closure color".into(),
            TypeName::Named(name) => self.0.name(name).into(),
            simple => format!("{simple:?}").to_lowercase(),
        }
    }

    fn params(&self, params: &[Param]) -> String {
        let param = |p: &Param| {
            let output = if p.output { "output " } else { "" };
            let (ty, name, length) = (self.ty(p.ty), self.0.name(p.name), self.length(&p.length));
            format!("{output}{ty} {name}{length}{}{}", self.init(p.default), self.metadata(&p.metadata))
        };
        params.iter().map(param).collect::<Vec<_>>().join(",")
    }

    fn metadata(&self, metadata: &[Metadatum]) -> String {
        let entry = |m: &Metadatum| format!("{} {}={}", self.ty(m.ty), self.0.name(m.name), self.root(m.value));
        let entries: Vec<String> = metadata.iter().map(entry).collect();
        if entries.is_empty() { String::new() } else { format!("[[{}]]", entries.join(",")) }
    }

    fn declarator(&self, d: &Declarator) -> String {
        format!("{}{}{}", self.0.name(d.name), self.length(&d.length), self.init(d.init))
    }

    fn length(&self, length: &Length) -> String {
        match length {
            Length::None => String::new(),
            Length::Open => "[]".into(),
            Length::Given(root) => format!("[{}]", self.root(*root)),
        }
    }

    fn init(&self, init: Option<Root>) -> String {
        init.map_or(String::new(), |root| format!("={}", self.root(root)))
    }

    fn block(&self, body: &[Stmt]) -> String {
        format!("{{{}}}", body.iter().map(|s| self.stmt(s)).collect::<String>())
    }

    fn stmt(&self, stmt: &Stmt) -> String {
        match stmt {
            Stmt::Declare(ty, declarators) => {
                let all: Vec<String> = declarators.iter().map(|d| self.declarator(d)).collect();
                format!("{} {};", self.ty(*ty), all.join(","))
            }
            Stmt::Expr(root) => format!("{};", self.root(*root)),
            Stmt::If { condition, then, other } => {
                let other = other.as_ref().map_or(String::new(), |o| format!("else {}", self.stmt(o)));
                format!("if({}){}{other}", self.root(*condition), self.stmt(then))
            }
            Stmt::Block(body) => self.block(body),
            Stmt::Loop(l) => {
                let part = |root: Option<Root>| root.map_or(String::new(), |r| self.root(r));
                let body = self.stmt(&l.body);
                if l.body_first {
                    return format!("do {body} while({});", part(l.condition));
                }
                let start: String = l.start.iter().map(|s| self.stmt(s)).collect();
                let start = if start.is_empty() { ";".into() } else { start };
                format!("for({start}{};{}){body}", part(l.condition), part(l.step))
            }
            Stmt::Break(_) => "break;".into(),
            Stmt::Continue(_) => "continue;".into(),
            Stmt::Return(value, _) => format!("return {};", value.map_or(String::new(), |r| self.root(r))),
        }
    }

    fn root(&self, root: Root) -> String {
        self.expr(root.root)
    }

    fn args(&self, args: Args) -> String {
        self.0.args(args).iter().map(|a| self.expr(*a)).collect::<Vec<_>>().join(",")
    }

    fn expr(&self, id: ExprId) -> String {
        let e = |id: ExprId| self.expr(id);
        match self.0.expr(id).kind {
            ExprKind::Int(i) => i.to_string(),
            ExprKind::Float(x) => format!("{x:?}"),
            ExprKind::String(s) => format!("{:?}", self.0.name(s)),
            ExprKind::Name(s) => self.0.name(s).to_owned(),
            ExprKind::Unary(op, a) => format!("({}{})", op.text(), e(a)),
            ExprKind::Binary(op, a, b) => format!("({}{}{})", e(a), op.text(), e(b)),
            ExprKind::Assign(op, a, b) => format!("({}{}={})", e(a), op.map_or("", |o| o.text()), e(b)),
            ExprKind::Ternary(a, b, c) => format!("({}?{}:{})", e(a), e(b), e(c)),
            ExprKind::Call(name, _, args) => format!("{}({})", self.0.name(name), self.args(args)),
            ExprKind::Construct(ty, args) => format!("{}({})", self.ty(ty), self.args(args)),
            ExprKind::Cast(ty, a) => format!("(({}) ({}))", self.ty(ty), e(a)),
            ExprKind::Index(a, i) => format!("{}[{}]", e(a), e(i)),
            ExprKind::Field(a, name, _) => format!("{}.{}", e(a), self.0.name(name)),
            ExprKind::List(args) => format!("{{{}}}", self.args(args)),
            ExprKind::Step(s, a) => {
                let op = if s.down { "--" } else { "++" };
                if s.after { format!("({}{op})", e(a)) } else { format!("({op}{})", e(a)) }
            }
            ExprKind::Comma(a, b) => format!("({},{})", e(a), e(b)),
        }
    }
}
