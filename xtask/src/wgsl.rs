//! WGSL's grammar of binary operators, which compilers that know C's precedence do not hold a text to.
//!
//! WGSL has no order among most operators: `a ^ b >> 3u` is no expression, it needs parentheses. naga reads
//! it as C would, a browser refuses it. So texts are held to the grammar here, by their tokens: nothing else
//! is parsed.

use std::fmt;

/// A mix of operators that needs parentheses.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Mixed {
    /// Counted from 1.
    pub(crate) line: usize,
    /// In their order.
    pub(crate) operators: Vec<String>,
}

impl fmt::Display for Mixed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: mixing '{}' requires parentheses", self.line, self.operators.join("' and '"))
    }
}

/// Every mix of operators in a text that WGSL's grammar refuses.
pub(crate) fn mixed(text: &str) -> Vec<Mixed> {
    let mut mixed = Vec::new();
    // One expression for each depth of brackets.
    let mut open = vec![Expression::default()];
    for (line, token) in tokens(text) {
        let at_end = |open: &mut Vec<Expression<'_>>, mixed: &mut Vec<Mixed>| {
            mixed.extend(open.last_mut().and_then(|expression| std::mem::take(expression).fault()));
        };
        match token {
            Token::Open("{") | Token::Separator => at_end(&mut open, &mut mixed),
            Token::Open(_) => {}
            Token::Close => {
                at_end(&mut open, &mut mixed);
                if open.len() > 1 {
                    open.pop();
                }
            }
            Token::Operand | Token::Operator(_) => {}
        }
        match token {
            Token::Open(_) => open.push(Expression::default()),
            Token::Close | Token::Operand => {
                if let Some(expression) = open.last_mut() {
                    expression.has_operand = true;
                }
            }
            Token::Operator(operator) => {
                if let Some(expression) = open.last_mut() {
                    expression.push(operator, line);
                }
            }
            Token::Separator => {}
        }
    }
    mixed.extend(open.into_iter().filter_map(Expression::fault));
    mixed
}

/// The binary operators of an expression at one depth of brackets.
#[derive(Default)]
struct Expression<'a> {
    operators: Vec<&'a str>,
    line: usize,
    /// True if an operand stands before what comes next, so that an operator there has two.
    has_operand: bool,
}

impl<'a> Expression<'a> {
    fn push(&mut self, operator: &'a str, line: usize) {
        if self.has_operand {
            if self.operators.is_empty() {
                self.line = line;
            }
            self.operators.push(operator);
        }
        self.has_operand = false;
    }

    fn fault(self) -> Option<Mixed> {
        let mut operators: Vec<String> = self.operators.iter().copied().map(String::from).collect();
        operators.dedup();
        (!is_expression(&self.operators)).then_some(Mixed { line: self.line, operators })
    }
}

/// The grammar's `expression`, of unary expressions with these operators between them.
fn is_expression(operators: &[&str]) -> bool {
    let all = |wanted: &str| operators.iter().all(|operator| *operator == wanted);
    let short_circuit = |wanted: &str| operators.split(|operator| *operator == wanted).all(is_relational);
    ["|", "&", "^"].into_iter().any(all) || short_circuit("||") || short_circuit("&&")
}

fn is_relational(operators: &[&str]) -> bool {
    let compares = |operator: &&str| ["<", ">", "<=", ">=", "==", "!="].contains(operator);
    let mut sides = operators.split(compares);
    sides.clone().count() <= 2 && sides.all(is_shift)
}

fn is_shift(operators: &[&str]) -> bool {
    let is_arithmetic = |operator: &&str| ["+", "-", "*", "/", "%"].contains(operator);
    matches!(operators, ["<<" | ">>"]) || operators.iter().all(is_arithmetic)
}

/// What of a text the grammar of operators asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Token<'a> {
    Open(&'a str),
    Close,
    Operand,
    Operator(&'a str),
    /// What no expression goes across.
    Separator,
}

const OPERATORS: [&str; 18] =
    ["<<", ">>", "<=", ">=", "==", "!=", "&&", "||", "<", ">", "+", "-", "*", "/", "%", "&", "|", "^"];
const SEPARATORS: [&str; 19] = [
    "<<=", ">>=", "->", "++", "--", "+=", "-=", "*=", "/=", "%=", "&=", "|=", "^=", "=", ",", ";", ":", "@",
    "}",
];
/// Words that end or begin a statement.
const WORDS: [&str; 18] = [
    "let",
    "var",
    "const",
    "override",
    "return",
    "if",
    "else",
    "for",
    "while",
    "loop",
    "switch",
    "case",
    "default",
    "fn",
    "struct",
    "continuing",
    "break",
    "alias",
];

fn tokens(text: &str) -> Vec<(usize, Token<'_>)> {
    let (templates, mut tokens, mut line, mut at) = (templates(text), Vec::new(), 1, 0);
    while let Some(c) = text[at..].chars().next() {
        let rest = &text[at..];
        let blank = blank(rest);
        if blank > 0 {
            line += rest[..blank].matches('\n').count();
            at += blank;
            continue;
        }
        let starts = |of: &[&'static str]| of.iter().copied().find(|token| rest.starts_with(token));
        let (token, length) = if templates.contains(&at) {
            (if c == '<' { Token::Open("<") } else { Token::Close }, 1)
        } else if is_of_word(c) {
            let length = word(rest);
            let is_word = WORDS.contains(&&rest[..length]);
            (if is_word { Token::Separator } else { Token::Operand }, length)
        } else if let Some(open) = starts(&["(", "[", "{"]) {
            (Token::Open(open), 1)
        } else if rest.starts_with([')', ']', '}']) {
            (Token::Close, 1)
        } else {
            // Of those that begin alike the longest counts.
            let (separator, operator) = (starts(&SEPARATORS), starts(&OPERATORS));
            let length = |token: Option<&str>| token.map_or(0, str::len);
            match (separator, operator) {
                (_, Some(operator)) if operator.len() >= length(separator) => {
                    (Token::Operator(operator), operator.len())
                }
                (Some(separator), _) => (Token::Separator, separator.len()),
                _ => (Token::Operand, c.len_utf8()),
            }
        };
        // A member's name, `!` and `~` leave an expression what it is.
        if !matches!(c, '.' | '!' | '~') || matches!(token, Token::Operator(_)) {
            tokens.push((line, token));
        }
        // After a block a statement begins.
        if c == '}' {
            tokens.push((line, Token::Separator));
        }
        at += length;
    }
    tokens
}

/// Bytes of white space or a comment at the start of a text; 0 where there is neither.
fn blank(text: &str) -> usize {
    if text.starts_with("//") {
        return text.find('\n').unwrap_or(text.len());
    }
    if text.starts_with("/*") {
        let (mut depth, mut at) = (1, 2);
        while depth > 0 && at < text.len() {
            let rest = &text[at..];
            let (deeper, length) = match (rest.starts_with("/*"), rest.starts_with("*/")) {
                (true, _) => (1, 2),
                (_, true) => (-1, 2),
                _ => (0, rest.chars().next().map_or(1, char::len_utf8)),
            };
            depth += deeper;
            at += length;
        }
        return at;
    }
    text.len() - text.trim_start().len()
}

fn is_of_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Bytes of the word or the number at the start of a text; `1e-3` is one number.
fn word(text: &str) -> usize {
    let end = |text: &str| text.find(|c| !is_of_word(c)).unwrap_or(text.len());
    let length = end(text);
    let is_decimal = text.starts_with(|c: char| c.is_ascii_digit()) && !text.starts_with("0x");
    if is_decimal && text[..length].ends_with(['e', 'E']) && text[length..].starts_with(['+', '-']) {
        return length + 1 + end(&text[length + 1..]);
    }
    length
}

/// The places of `<` and `>` that stand around a template's parameters: the specification's "template list
/// discovery".
fn templates(text: &str) -> std::collections::BTreeSet<usize> {
    let (mut found, mut pending) = (std::collections::BTreeSet::new(), Vec::<(usize, usize)>::new());
    let (mut at, mut depth) = (0, 0_usize);
    while let Some(c) = text[at..].chars().next() {
        let rest = &text[at..];
        let blank_here = blank(rest);
        if blank_here > 0 {
            at += blank_here;
            continue;
        }
        if is_of_word(c) {
            at += word(rest);
            while blank(&text[at..]) > 0 {
                at += blank(&text[at..]);
            }
            let rest = &text[at..];
            if rest.starts_with('<') && !c.is_ascii_digit() {
                if rest.starts_with("<<") || rest.starts_with("<=") {
                    at += 2;
                } else {
                    pending.push((at, depth));
                    at += 1;
                }
            }
            continue;
        }
        let mut length = c.len_utf8();
        match c {
            '>' => {
                if let Some(&(start, _)) = pending.last().filter(|(_, at_depth)| *at_depth == depth) {
                    pending.pop();
                    found.extend([start, at]);
                } else if rest.starts_with(">=") {
                    length = 2;
                }
            }
            '(' | '[' => depth += 1,
            ')' | ']' => {
                pending.retain(|(_, at_depth)| *at_depth < depth);
                depth = depth.saturating_sub(1);
            }
            '!' | '=' if rest[1..].starts_with('=') => length = 2,
            '=' | ';' | '{' | ':' => {
                depth = 0;
                pending.clear();
            }
            '&' | '|' if rest.starts_with("&&") || rest.starts_with("||") => {
                pending.retain(|(_, at_depth)| *at_depth < depth);
                length = 2;
            }
            _ => {}
        }
        at += length;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_refused(expression: &str) -> bool {
        !mixed(&format!("fn f(a: vec2<u32>) -> u32 {{\n    return {expression};\n}}")).is_empty()
    }

    #[test]
    fn what_the_grammar_refuses_is_refused() {
        for expression in [
            "wanted << BITS | slot",
            "a ^ a >> 16u",
            "(a ^ a >> 13u) * 7u",
            "a.x ^ a.y * 3u",
            "a.x * 3u ^ a.y * 5u",
            "state >> 9u & 1u",
            "vec2<u32>(a.x | a.y << 24u, 1u)",
            "values[i & j + 1u]",
            "a & b == c",
            "a | b & c",
            "a << b << c",
            "a + b << c",
            "a << b + c",
            "a < b == c",
            "a && b || c",
            "a | b && c",
            "select(1.0, 2.0, a & 1u == 1u)",
            "f(a)[1] | b.x << 2u",
            "a |\n // with a comment\n b << 2u",
            "-a & b + c",
        ] {
            assert!(is_refused(expression), "{expression}");
        }
    }

    #[test]
    fn what_the_grammar_accepts_is_accepted() {
        for expression in [
            "(wanted << BITS) | slot",
            "a ^ (a >> 16u)",
            "a | b | c",
            "a & b & c",
            "a >> 10u > 1u",
            "a + b * c - d % e < f / g",
            "a < b && c > d && !e",
            "a == b || c != d",
            "f(a, b)[i + 1u].x << 2u",
            "-a.x << 1u",
            "array<vec4<f32>, 4>(x, y)[i] * 1e-3 + 1.5e+2",
            "vec2<u32>(a.x, 3u) & b",
            "bitcast<u32>(x) >> 3u",
            "select(a, b, c < d) - select(a, b, c > d)",
            "~a & b",
            "a /* b << c | d */ + e // f ^ g >> h",
        ] {
            assert!(
                !is_refused(expression),
                "{expression}: {:?}",
                mixed(&format!("fn f() {{ return {expression}; }}"))
            );
        }
        let text = "
            @group(0) @binding(1) var<storage, read_write> cells: array<atomic<u32>>;
            const N: u32 = 1u << 3u;
            override M: u32 = 2u;
            @compute @workgroup_size(8, 8) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
                var x = 1u; x += 3u; x <<= 2u; x++;
                for (var i = 0u; i < N; i++) { if (i & 1u) == 1u && x > 2u { continue; } }
                let y = x; let z = y - 1u;
                *p = a * *q; let r = &x;
            }";
        assert_eq!(mixed(text), []);
    }

    #[test]
    fn a_fault_is_told_with_its_line() {
        let fault = mixed("fn f() {\n    let a = 1u;\n    let b = a ^ a >> 3u;\n}").remove(0);
        assert_eq!(fault.to_string(), "line 3: mixing '^' and '>>' requires parentheses");
    }
}
