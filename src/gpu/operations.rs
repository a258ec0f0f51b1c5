//! Counts the operations of a pass by instrumenting it.
//!
//! An instrumented version of the pass adds up what it computes beside its work: each statement
//! adds the operations of the expressions that it evaluates, as parsed by naga, so that loops count
//! once per iteration and branches only where they are taken. It writes to copies of the buffers
//! that the pass writes, so the state does not change.

use naga::{
    BinaryOperator, Block, Expression, Function, GlobalVariable, Handle, Literal, MathFunction,
    Module, Range, ScalarKind, Span, Statement, Type, TypeInner, UnaryOperator, UniqueArena,
    valid::FunctionInfo,
};
use wgpu::BufferUsages;

use super::{
    adapter::Context,
    error::GpuError,
    program::{self, Pass, Program},
    recording::{Bind, Size, bind, bound, dispatch_sized},
    reflect,
    statements::nested_blocks,
};

/// Operations on floats and on integers, for each component of a vector. Multiplication, addition,
/// division, comparison, minimum, square root, exponential and sine count as one, as do bit
/// operations; `fma` counts as two, and a vector function as its formula (`dot` of three
/// components is five). Loads, stores, atomics, conversions, selections, swizzles and boolean
/// logic do not count. Operations that a compiler later removes or shares among threads are
/// counted nevertheless.
pub type Operations = [u64; 2];

/// Binding index of the sums, far beyond those of passes.
const BINDING: u32 = 99;
const FLOATS: &str = "counted_floats";
const INTEGERS: &str = "counted_integers";
const TELL: &str = "tell_counted";
/// Sums over all threads, two words each, the lower first.
const SUMS: &str = "
@group(0) @binding(99) var<storage, read_write> counted_operations: array<atomic<u32>, 4>;
var<private> counted_floats: u32;
var<private> counted_integers: u32;
fn add_counted(word: u32, count: u32) {
    let before = atomicAdd(&counted_operations[word], count);
    if before + count < before {
        atomicAdd(&counted_operations[word + 1u], 1u);
    }
}
fn tell_counted() {
    add_counted(0u, counted_floats);
    add_counted(2u, counted_integers);
}
";

/// Instrumented version of a pass, which counts operations.
#[derive(Debug)]
pub(super) struct Counting {
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
}

impl Counting {
    /// Compiles that of `pass`; `None` if the adapter does not support one buffer more than the
    /// pass has.
    pub(super) fn new(context: &Context, pass: &Pass) -> Result<Option<Self>, GpuError> {
        let storage = pass.bindings.iter().filter(|at| at.access.is_storage());
        if storage.count() as u32 >= context.limits.max_storage_buffers_per_shader_stage {
            return Ok(None);
        }
        let text = program::source(context, pass.name, &pass.defines)?.text + SUMS;
        let module = counting(pass.name, &text)?;
        let mut entries = program::entries(&pass.bindings, wgpu::ShaderStages::COMPUTE);
        entries.push(wgpu::BindGroupLayoutEntry {
            binding: BINDING,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: program::binding_type(reflect::Access::ReadWrite),
            count: None,
        });
        let source = wgpu::ShaderSource::Naga(std::borrow::Cow::Owned(module));
        let (module, layout, pipeline_layout) =
            program::module(context, pass.name, &entries, source)?;
        let pipeline = program::checked(context, pass.name, || {
            program::pipeline(
                context,
                pass.name,
                &pipeline_layout,
                &module,
                &pass.constants,
            )
        })?;
        Ok(Some(Self { pipeline, layout }))
    }
}

/// Counts the operations of one run of a pass with these bindings and this size, from the current
/// contents of the buffers, which do not change. `None` if the adapter does not support one buffer
/// more, or has no memory for the copies. Waits for the device.
pub(super) fn count(
    program: &Program,
    pass: &'static str,
    binds: &[Bind],
    size: &Size,
) -> Result<Option<Operations>, GpuError> {
    let context = &program.context;
    let pass = program.pass(pass);
    let Some(counting) = pass.counting(context)? else {
        return Ok(None);
    };
    let device = &context.device;
    let buffer = |label, size, usage| {
        device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size,
            usage,
            mapped_at_creation: false,
        })
    };
    let mut encoder = device.create_command_encoder(&Default::default());
    let scope = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let written = pass.bindings.iter().filter(|binding| binding.is_written);
    let copies: Vec<_> = written
        .map(|binding| {
            let (from, offset, bytes) = bound(program, binding, binds);
            let usage = BufferUsages::STORAGE | BufferUsages::COPY_DST;
            let copy = buffer("written while counting", bytes, usage);
            (binding.index, copy, (from, offset, bytes))
        })
        .collect();
    let bytes = size_of::<[u32; 4]>() as u64;
    let sums = buffer(
        "counted_operations",
        bytes,
        BufferUsages::STORAGE | BufferUsages::COPY_SRC,
    );
    let told = buffer(
        "operations",
        bytes,
        BufferUsages::COPY_DST | BufferUsages::MAP_READ,
    );
    if pollster::block_on(scope.pop()).is_some() {
        return Ok(None);
    }
    let mut apart = vec![(BINDING, sums.clone())];
    for (index, copy, (from, offset, bytes)) in copies {
        encoder.copy_buffer_to_buffer(from, offset, &copy, 0, bytes);
        apart.push((index, copy));
    }
    let group = bind(
        program,
        pass.name,
        &counting.layout,
        &pass.bindings,
        binds,
        &apart,
    );
    {
        let mut compute = encoder.begin_compute_pass(&Default::default());
        compute.set_pipeline(&counting.pipeline);
        compute.set_bind_group(0, &group, &[]);
        dispatch_sized(program, &mut compute, size);
    }
    encoder.copy_buffer_to_buffer(&sums, 0, &told, 0, bytes);
    context.queue.submit([encoder.finish()]);
    told.map_async(wgpu::MapMode::Read, .., |_| {});
    context.wait()?;
    let view = told
        .get_mapped_range(..)
        .map_err(|error| GpuError::Lost(error.to_string()))?;
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(&view);
    let sum = |at: usize| u64::from(words[at]) | u64::from(words[at + 1]) << 32;
    Ok(Some([sum(0), sum(2)]))
}

/// Instruments the module of a pass's text, which must be followed by [`SUMS`].
fn counting(name: &str, text: &str) -> Result<Module, GpuError> {
    let (mut module, info) = reflect::validated(name, text, &|line| format!("line {line}"))?;
    let fault = |what: &str| GpuError::Shader {
        name: name.to_owned(),
        message: format!("{what} is not in it"),
    };
    let global = |wanted: &str| {
        let is_it = |global: &GlobalVariable| global.name.as_deref() == Some(wanted);
        let found = module.global_variables.fetch_if(is_it);
        found.ok_or_else(|| fault(wanted))
    };
    let sums = [global(FLOATS)?, global(INTEGERS)?];
    let is_tell = |function: &Function| function.name.as_deref() == Some(TELL);
    let tell = (module.functions.fetch_if(is_tell)).ok_or_else(|| fault(TELL))?;
    let types = &module.types;
    // The functions of SUMS are the last two.
    let own = module.functions.len() - 2;
    for (handle, function) in module.functions.iter_mut().take(own) {
        let info = &info[handle];
        Meter { info, types, sums }.put_into(function, None);
    }
    for (index, entry) in module.entry_points.iter_mut().enumerate() {
        let info = info.get_entry_point(index);
        Meter { info, types, sums }.put_into(&mut entry.function, Some(tell));
    }
    Ok(module)
}

/// Instruments functions.
struct Meter<'a> {
    info: &'a FunctionInfo,
    types: &'a UniqueArena<Type>,
    /// Sums of operations on floats and on integers.
    sums: [Handle<GlobalVariable>; 2],
}

impl Meter<'_> {
    /// Instruments a function; `tell` is called at the end of an entry point.
    fn put_into(&self, function: &mut Function, tell: Option<Handle<Function>>) {
        let body = std::mem::take(&mut function.body);
        function.body = self.block(function, body, tell);
    }

    fn block(
        &self,
        function: &mut Function,
        block: Block,
        tell: Option<Handle<Function>>,
    ) -> Block {
        let mut metered = Block::with_capacity(2 * block.len());
        for (mut statement, span) in block.span_into_iter() {
            nested_blocks(&mut statement, &mut |block| {
                *block = self.block(function, std::mem::take(block), tell);
            });
            let mut emitted = None;
            match &statement {
                Statement::Emit(range) => emitted = Some(range.clone()),
                // naga ends each path through a function with a return.
                Statement::Return { .. } => {
                    if let Some(tell) = tell {
                        let call = Statement::Call {
                            function: tell,
                            arguments: Vec::new(),
                            result: None,
                        };
                        metered.push(call, Span::UNDEFINED);
                    }
                }
                _ => {}
            }
            metered.push(statement, span);
            if let Some(range) = emitted {
                let counts = self.operations(function, range);
                for (sum, count) in self.sums.into_iter().zip(counts) {
                    add(function, &mut metered, sum, count);
                }
            }
        }
        metered
    }

    /// Operations of the emitted expressions, on floats and on integers.
    fn operations(&self, function: &Function, emitted: Range<Expression>) -> [u32; 2] {
        let mut counts = [0; 2];
        for handle in emitted {
            let (kind, count) = self.operation(function, handle);
            match kind {
                ScalarKind::Float => counts[0] += count,
                ScalarKind::Sint | ScalarKind::Uint => counts[1] += count,
                _ => {}
            }
        }
        counts
    }

    fn operation(&self, function: &Function, handle: Handle<Expression>) -> (ScalarKind, u32) {
        match function.expressions[handle] {
            Expression::Unary { op, expr } => {
                let shape = self.shape(expr);
                let is_one = op != UnaryOperator::LogicalNot;
                (shape.kind, u32::from(is_one) * shape.count())
            }
            Expression::Binary { op, left, right } => {
                let (left, right) = (self.shape(left), self.shape(right));
                let count = match op {
                    BinaryOperator::Multiply => left.product(right),
                    _ => left.count().max(right.count()),
                };
                (left.kind, count)
            }
            Expression::Math { fun, arg, .. } => {
                let shape = self.shape(arg);
                (shape.kind, of_function(fun, shape.count()))
            }
            _ => (ScalarKind::Bool, 0),
        }
    }

    fn shape(&self, expression: Handle<Expression>) -> Shape {
        let (columns, rows, scalar) = match *self.info[expression].ty.inner_with(self.types) {
            TypeInner::Scalar(scalar) => (1, 1, Some(scalar)),
            TypeInner::Vector { size, scalar } => (1, size as u32, Some(scalar)),
            TypeInner::Matrix {
                columns,
                rows,
                scalar,
            } => (columns as u32, rows as u32, Some(scalar)),
            _ => (1, 1, None),
        };
        Shape {
            columns,
            rows,
            kind: scalar.map_or(ScalarKind::Bool, |scalar| scalar.kind),
        }
    }
}

/// Shape of a scalar, a vector or a matrix.
#[derive(Clone, Copy)]
struct Shape {
    columns: u32,
    rows: u32,
    kind: ScalarKind,
}

impl Shape {
    fn count(self) -> u32 {
        self.columns * self.rows
    }

    fn product(self, right: Self) -> u32 {
        match (self.columns > 1, right.columns > 1) {
            // A matrix times a matrix or a vector.
            (true, _) if right.count() > 1 => self.rows * right.columns * (2 * self.columns - 1),
            // A row vector times a matrix.
            (false, true) if self.rows > 1 => right.columns * (2 * right.rows - 1),
            _ => self.count().max(right.count()),
        }
    }
}

/// Operations of a function whose first argument has `n` components.
fn of_function(function: MathFunction, n: u32) -> u32 {
    match function {
        MathFunction::Dot => 2 * n - 1,
        MathFunction::Cross => 9,
        MathFunction::Length => 2 * n,
        MathFunction::Distance | MathFunction::Normalize | MathFunction::Mix => 3 * n,
        MathFunction::Fma | MathFunction::Clamp | MathFunction::Saturate => 2 * n,
        // (x − a) / (b − a), clamped to 0 to 1, and t² (3 − 2 t).
        MathFunction::SmoothStep => 9 * n,
        // e₁ − 2 (e₂ · e₁) e₂.
        MathFunction::Reflect => 4 * n,
        // With d = e₂ · e₁ and k = 1 − η² (1 − d²): η e₁ − (η d + √k) e₂.
        MathFunction::Refract => 5 * n + 7,
        MathFunction::Transpose => 0,
        _ => n,
    }
}

/// Appends statements that add `count` to a sum.
fn add(function: &mut Function, block: &mut Block, sum: Handle<GlobalVariable>, count: u32) {
    if count == 0 {
        return;
    }
    let mut put = |expression| function.expressions.append(expression, Span::UNDEFINED);
    let pointer = put(Expression::GlobalVariable(sum));
    let right = put(Expression::Literal(Literal::U32(count)));
    let left = put(Expression::Load { pointer });
    let op = BinaryOperator::Add;
    let value = put(Expression::Binary { op, left, right });
    let range = Range::new_from_bounds(left, value);
    block.push(Statement::Emit(range), Span::UNDEFINED);
    block.push(Statement::Store { pointer, value }, Span::UNDEFINED);
}
