//! Replaces operations of a module with calls.

use std::mem;

use naga::{
    AddressSpace, Arena, BinaryOperator, Block, Expression, Function, Handle, MathFunction, Module,
    Range, Scalar, Span, Statement, Type, TypeInner, UniqueArena,
    valid::{FunctionInfo, ModuleInfo},
};

use super::{
    super::statements::nested_blocks,
    Imprecision,
    call::{Call, PREFIX},
};

/// Replaces each operation for whose call there is a function.
pub(super) fn rewrite(
    profile: &Imprecision,
    pass: &str,
    module: &mut Module,
    info: &ModuleInfo,
    find: &mut dyn FnMut(Call) -> Option<Handle<Function>>,
) {
    let types = &module.types;
    let functions = module.functions.iter_mut();
    let functions = functions.map(|(handle, function)| (function, &info[handle]));
    let entries = module.entry_points.iter_mut().enumerate();
    let entries = entries.map(|(k, entry)| (&mut entry.function, info.get_entry_point(k)));
    for (function, info) in functions.chain(entries) {
        let name = function.name.clone().unwrap_or_default();
        if name.starts_with(PREFIX) {
            continue;
        }
        let site = format!("{pass} {name} {}", profile.seed);
        let seen = Seen {
            profile,
            original: function.expressions.clone(),
            info,
            types,
            site: blake3::hash(site.as_bytes()),
        };
        let body = mem::take(&mut function.body);
        function.body = seen.block(&mut function.expressions, body, find);
    }
}

/// A function as it was.
struct Seen<'a> {
    profile: &'a Imprecision,
    original: Arena<Expression>,
    info: &'a FunctionInfo,
    types: &'a UniqueArena<Type>,
    site: blake3::Hash,
}

impl Seen<'_> {
    fn block(
        &self,
        expressions: &mut Arena<Expression>,
        block: Block,
        find: &mut dyn FnMut(Call) -> Option<Handle<Function>>,
    ) -> Block {
        let mut rewritten = Block::with_capacity(2 * block.len());
        for (mut statement, span) in block.span_into_iter() {
            nested_blocks(&mut statement, &mut |block| {
                *block = self.block(expressions, mem::take(block), find);
            });
            match statement {
                Statement::Emit(range) => {
                    for handle in range {
                        self.emit(expressions, &mut rewritten, handle, find);
                    }
                }
                _ => rewritten.push(statement, span),
            }
        }
        rewritten
    }

    /// Emits an expression, or calls the function that replaces it.
    fn emit(
        &self,
        expressions: &mut Arena<Expression>,
        block: &mut Block,
        handle: Handle<Expression>,
        find: &mut dyn FnMut(Call) -> Option<Handle<Function>>,
    ) {
        let emit = |handle| Statement::Emit(Range::new_from_bounds(handle, handle));
        let found = self
            .call(handle)
            .and_then(|(call, arguments)| Some((find(call)?, arguments)));
        let Some((function, mut arguments)) = found else {
            block.push(emit(handle), Span::UNDEFINED);
            return;
        };
        let replaced = mem::replace(
            expressions.get_mut(handle),
            Expression::CallResult(function),
        );
        if arguments.is_empty() {
            let moved = expressions.append(replaced, Span::UNDEFINED);
            block.push(emit(moved), Span::UNDEFINED);
            arguments.push(moved);
        }
        let call = Statement::Call {
            function,
            arguments,
            result: Some(handle),
        };
        block.push(call, Span::UNDEFINED);
    }

    /// What replaces an expression, with its arguments: those of the expression, or none if it is
    /// itself the argument.
    fn call(&self, handle: Handle<Expression>) -> Option<(Call, Vec<Handle<Expression>>)> {
        if self.is_constant(handle) {
            return None;
        }
        let (what, arguments) = match self.original[handle] {
            Expression::Load { pointer } if self.profile.flushes && self.is_input(pointer) => {
                let sizes = vec![self.size(handle)?];
                return Some((
                    Call {
                        what: "flush",
                        sizes,
                    },
                    Vec::new(),
                ));
            }
            Expression::Binary { op, left, right } => self.binary(handle, op, [left, right])?,
            Expression::Math {
                fun,
                arg,
                arg1,
                arg2,
                ..
            } => {
                let what = self.function(fun)?;
                (
                    what,
                    [Some(arg), arg1, arg2].into_iter().flatten().collect(),
                )
            }
            _ => return None,
        };
        let sizes = arguments.iter().map(|&argument| self.size(argument));
        let sizes = sizes.collect::<Option<Vec<usize>>>()?;
        Some((Call { what, sizes }, arguments))
    }

    fn binary(
        &self,
        handle: Handle<Expression>,
        op: BinaryOperator,
        [left, right]: [Handle<Expression>; 2],
    ) -> Option<(&'static str, Vec<Handle<Expression>>)> {
        let is_fused = self.contracts(handle);
        let factors = |product| match self.original[product] {
            Expression::Binary {
                op: BinaryOperator::Multiply,
                left,
                right,
            } if is_fused && !self.is_constant(product) => [left, right]
                .iter()
                .all(|&factor| self.size(factor).is_some())
                .then_some([left, right]),
            _ => None,
        };
        let fused = |what, [a, b]: [_; 2], c| Some((what, vec![a, b, c]));
        match (op, factors(left), factors(right)) {
            (BinaryOperator::Add, Some(product), _) => fused("fused", product, right),
            (BinaryOperator::Add, None, Some(product)) => fused("fused", product, left),
            (BinaryOperator::Subtract, Some(product), _) => fused("fused_less", product, right),
            (BinaryOperator::Subtract, None, Some(product)) => fused("less_fused", product, left),
            (BinaryOperator::Divide, ..) if self.profile.division > 0.0 => {
                Some(("divide", vec![left, right]))
            }
            _ if !self.profile.flushes => None,
            (BinaryOperator::Add, ..) => Some(("add", vec![left, right])),
            (BinaryOperator::Subtract, ..) => Some(("subtract", vec![left, right])),
            (BinaryOperator::Multiply, ..) => Some(("multiply", vec![left, right])),
            _ => None,
        }
    }

    fn function(&self, function: MathFunction) -> Option<&'static str> {
        let Imprecision {
            square_root,
            inverse_square_root,
            length,
            exponential,
            sine,
            contraction,
            ..
        } = *self.profile;
        let (what, error) = match function {
            MathFunction::Sqrt => ("sqrt", square_root),
            MathFunction::InverseSqrt => ("inverse_sqrt", inverse_square_root),
            MathFunction::Normalize => ("normalize", inverse_square_root),
            MathFunction::Length => ("length", length),
            MathFunction::Distance => ("distance", length),
            MathFunction::Exp => ("exp", exponential),
            MathFunction::Exp2 => ("exp2", exponential),
            MathFunction::Log => ("log", exponential),
            MathFunction::Log2 => ("log2", exponential),
            MathFunction::Pow => ("pow", exponential),
            MathFunction::Sin => ("sin", sine),
            MathFunction::Cos => ("cos", sine),
            MathFunction::Dot => ("dot", contraction),
            MathFunction::Cross => ("cross", contraction),
            MathFunction::Mix => ("mix", contraction),
            _ => return None,
        };
        (error > 0.0).then_some(what)
    }

    /// Whether a sum with a product is rounded once: a compiler may decide otherwise at each.
    fn contracts(&self, handle: Handle<Expression>) -> bool {
        let mut hasher = blake3::Hasher::new();
        hasher.update(self.site.as_bytes());
        hasher.update(&(handle.index() as u64).to_le_bytes());
        let part = f32::from(hasher.finalize().as_bytes()[0]) / 256.0;
        part < self.profile.contraction
    }

    /// Components of an f32 or a vector of f32.
    fn size(&self, handle: Handle<Expression>) -> Option<usize> {
        match *self.info[handle].ty.inner_with(self.types) {
            TypeInner::Scalar(Scalar::F32) => Some(1),
            TypeInner::Vector {
                size,
                scalar: Scalar::F32,
            } => Some(size as usize),
            _ => None,
        }
    }

    /// Whether a pointer leads into a buffer.
    fn is_input(&self, pointer: Handle<Expression>) -> bool {
        match *self.info[pointer].ty.inner_with(self.types) {
            TypeInner::Pointer { space, .. } | TypeInner::ValuePointer { space, .. } => {
                matches!(space, AddressSpace::Uniform | AddressSpace::Storage { .. })
            }
            _ => false,
        }
    }

    /// Whether the host evaluates an expression before the shader is compiled.
    fn is_constant(&self, handle: Handle<Expression>) -> bool {
        let all = |of: &[Handle<Expression>]| of.iter().all(|&handle| self.is_constant(handle));
        match &self.original[handle] {
            Expression::Literal(_)
            | Expression::Constant(_)
            | Expression::Override(_)
            | Expression::ZeroValue(_) => true,
            Expression::Compose { components, .. } => all(components),
            Expression::Splat { value, .. } => all(&[*value]),
            Expression::AccessIndex { base, .. } => all(&[*base]),
            Expression::Swizzle { vector, .. } => all(&[*vector]),
            Expression::Unary { expr, .. } | Expression::As { expr, .. } => all(&[*expr]),
            Expression::Binary { left, right, .. } => all(&[*left, *right]),
            Expression::Math {
                arg, arg1, arg2, ..
            } => [Some(*arg), *arg1, *arg2]
                .into_iter()
                .flatten()
                .all(|it| all(&[it])),
            _ => false,
        }
    }
}
