//! What a sample asks of a GPU by its own text: fetches and arithmetic in the shader, which no other load on
//! the machine disturbs.
//!
//! Counted in naga's form of the text that pipelines are made of, before any driver has made it shorter: both
//! sides of each branch, each loop once. So a filter with a loop over its taps has the figures of one tap,
//! and anisotropic ones all have the same.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::ops::AddAssign;

use anyhow::{Context, Result};
use naga::{
    AddressSpace, BinaryOperator, Block, Expression, Function, Handle, Literal, Module, ScalarKind, Statement,
};
use vastex::Filter;
use vastex_wgpu::{Atlas, BindingPlace, FeedbackMode, Kind, Kinds, PageSides, TableKind, wgsl};

use crate::world::{Bench, Part};

const SAMPLED: &str = "
    @fragment fn sampled(@location(0) uv: vec2<f32>) -> @location(0) vec4<f32> {
        return vastex_sample(7u, uv);
    }
";

/// What is asked for.
#[derive(Clone, Copy, Default)]
struct Operations {
    /// Reads of a texture, filtered or not.
    fetches: u32,
    /// Reads of a page table.
    table: u32,
    /// Reads of records, 16 bytes each.
    records: u32,
    /// Reads of uniforms, words.
    words: u32,
    /// Arithmetic, each component for itself.
    arithmetic: u32,
    /// Of these divisions of whole numbers, which GPUs have no instruction for.
    divisions: u32,
}

impl AddAssign for Operations {
    fn add_assign(&mut self, other: Operations) {
        self.fetches += other.fetches;
        self.table += other.table;
        self.records += other.records;
        self.words += other.words;
        self.arithmetic += other.arithmetic;
        self.divisions += other.divisions;
    }
}

pub(crate) fn section(_: &Bench) -> Result<Part> {
    let mut page = String::from(
        "## Operations\n\nWhat `vastex_sample` asks for by its text, whatever the adapter: both sides of each branch, each loop once (so of an\n\
         anisotropic filter the figures are those of two taps, one looked up apart). Pages whose sides are powers of two, as all that Vastex\n\
         builds by default, are found by shifts; others by division.\n\n\
         | filter | pages | fetches | reads of the table | of records | words of uniforms | arithmetic | divisions of whole numbers |\n\
         |---|---|---|---|---|---|---|---|\n",
    );
    for filter in Filter::KINDS {
        for (name, pages) in [("powers of two", PageSides::PowersOfTwo), ("any", PageSides::Any)] {
            let (tables, atlas) = (TableKind::Direct, Atlas::Float);
            let dims = vastex_core::Dims::D2;
            let kind = Kind { dims, tables, pages, layer: 0, atlas, scale: 1, filter, is_mixed: true };
            let kinds = Kinds::of(kind, FeedbackMode::Separate, false);
            let Operations { fetches, table, records, words, arithmetic, divisions } = counted(&kinds)?;
            writeln!(
                page,
                "| {filter} | {name} | {fetches} | {table} | {records} | {words} | {arithmetic} | {divisions} |"
            )?;
        }
    }
    Ok((page, Vec::new()))
}

fn counted(kinds: &Kinds) -> Result<Operations> {
    let text = SAMPLED.to_owned() + &wgsl(kinds, BindingPlace::default());
    let module = naga::front::wgsl::parse_str(&text)?;
    let flags = naga::valid::ValidationFlags::all();
    let info = naga::valid::Validator::new(flags, naga::valid::Capabilities::empty()).validate(&module)?;
    let entry = module.entry_points.first().context("the text has an entry point")?;
    let mut counter = Counter { module: &module, info: &info, known: BTreeMap::new() };
    let entry = Call { function: &entry.function, info: info.get_entry_point(0), arguments: Vec::new() };
    Ok(counter.of_block(&entry.function.body, &entry))
}

struct Counter<'a> {
    module: &'a Module,
    info: &'a naga::valid::ModuleInfo,
    known: BTreeMap<(usize, Vec<Option<bool>>), Operations>,
}

/// A function as it is called.
struct Call<'a> {
    function: &'a Function,
    info: &'a naga::valid::FunctionInfo,
    /// The arguments that are truth values and constants of the text.
    arguments: Vec<Option<bool>>,
}

impl<'a> Counter<'a> {
    fn of_block(&mut self, block: &Block, call: &Call<'a>) -> Operations {
        let mut sum = Operations::default();
        for statement in block {
            match statement {
                Statement::Emit(range) => {
                    range.clone().for_each(|expression| sum += self.of_expression(expression, call));
                }
                Statement::Block(block) => sum += self.of_block(block, call),
                Statement::If { condition, accept, reject } => match self.known(*condition, call) {
                    Some(is_so) => {
                        let taken = if is_so { accept } else { reject };
                        sum += self.of_block(taken, call);
                        if let Some(Statement::Return { .. }) = taken.last() {
                            return sum;
                        }
                    }
                    None => {
                        [accept, reject].iter().for_each(|side| sum += self.of_block(side, call));
                    }
                },
                Statement::Switch { cases, .. } => {
                    cases.iter().for_each(|case| sum += self.of_block(&case.body, call));
                }
                Statement::Loop { body, continuing, .. } => {
                    sum += self.of_block(body, call);
                    sum += self.of_block(continuing, call);
                }
                Statement::Call { function: called, arguments, .. } => {
                    let arguments = arguments.iter().map(|argument| self.known(*argument, call)).collect();
                    sum += self.of_called(*called, arguments);
                }
                _ => (),
            }
        }
        sum
    }

    /// What a condition on constants of the text comes to, which a driver knows too.
    fn known(&self, condition: Handle<Expression>, call: &Call<'a>) -> Option<bool> {
        let function = call.function;
        let constant = |expression: Handle<Expression>| match function.expressions[expression] {
            Expression::Constant(constant) => {
                match self.module.global_expressions[self.module.constants[constant].init] {
                    Expression::Literal(literal) => Some(literal),
                    _ => None,
                }
            }
            Expression::Literal(literal) => Some(literal),
            _ => None,
        };
        match function.expressions[condition] {
            Expression::FunctionArgument(nth) => *call.arguments.get(nth as usize)?,
            Expression::Literal(_) | Expression::Constant(_) => match constant(condition)? {
                Literal::Bool(known) => Some(known),
                _ => None,
            },
            Expression::Binary { op: BinaryOperator::Equal, left, right } => {
                Some(constant(left)? == constant(right)?)
            }
            Expression::Binary { op: BinaryOperator::NotEqual, left, right } => {
                Some(constant(left)? != constant(right)?)
            }
            _ => None,
        }
    }

    fn of_called(&mut self, called: Handle<Function>, arguments: Vec<Option<bool>>) -> Operations {
        let key = (called.index(), arguments.clone());
        if let Some(known) = self.known.get(&key) {
            return *known;
        }
        let function = &self.module.functions[called];
        let call = Call { function, info: &self.info[called], arguments };
        let operations = self.of_block(&function.body, &call);
        self.known.insert(key, operations);
        operations
    }

    fn of_expression(&self, expression: Handle<Expression>, call: &Call<'a>) -> Operations {
        let (function, info) = (call.function, call.info);
        let inner = info[expression].ty.inner_with(&self.module.types);
        let components = inner.components().unwrap_or(1);
        let none = Operations::default();
        match &function.expressions[expression] {
            // Records are a texture of whole numbers, atlases of this bench are not.
            Expression::ImageLoad { .. } if inner.scalar_kind() == Some(ScalarKind::Uint) => {
                Operations { records: 1, ..none }
            }
            Expression::ImageSample { .. } | Expression::ImageLoad { .. } => {
                Operations { fetches: 1, ..none }
            }
            Expression::Load { pointer } => {
                match info[*pointer].ty.inner_with(&self.module.types).pointer_space() {
                    Some(AddressSpace::Storage { .. }) => Operations { table: 1, ..none },
                    Some(AddressSpace::Uniform) => Operations { words: components, ..none },
                    _ => none,
                }
            }
            Expression::Binary { op, .. } => {
                let is_whole = matches!(inner.scalar_kind(), Some(ScalarKind::Uint | ScalarKind::Sint));
                let is_division = matches!(op, BinaryOperator::Divide | BinaryOperator::Modulo);
                let divisions = if is_whole && is_division { components } else { 0 };
                Operations { arithmetic: components, divisions, ..none }
            }
            Expression::Unary { .. }
            | Expression::Math { .. }
            | Expression::Select { .. }
            | Expression::Relational { .. }
            | Expression::Derivative { .. } => Operations { arithmetic: components, ..none },
            Expression::As { convert: Some(_), .. } => Operations { arithmetic: components, ..none },
            _ => none,
        }
    }
}
