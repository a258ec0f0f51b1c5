//! Checks what an edited shader must not change: the buffers that the program binds to it, and
//! their layout.

use super::{
    buffer::BufferSpec,
    reflect::{Access, Binding, ElementType, Layout, Reflection},
};

/// Compares the bindings of an edited pass with those of the shipped one. A binding that the
/// shipped pass lacks may be any of the program's `buffers`.
///
/// # Errors
/// A message about the first mismatch.
pub(super) fn check(
    edited: &Reflection,
    shipped: &Reflection,
    buffers: &[BufferSpec],
) -> Result<(), String> {
    for binding in &edited.bindings {
        let name = &binding.name;
        let of_pass = shipped.bindings.iter().find(|known| known.name == *name);
        let of_program = buffers.iter().find(|known| known.name == *name);
        match (of_pass, of_program) {
            (Some(known), _) => same_element(binding, known.access, &known.element)?,
            (None, Some(known)) => {
                let access = match known.is_uniform {
                    true => Access::Uniform,
                    false => Access::ReadWrite,
                };
                let element = ElementType {
                    stride: known.element.bytes,
                    scalar: known.element.scalar,
                    name: None,
                    head: known.element.head,
                };
                same_element(binding, access, &element)?;
            }
            (None, None) => {
                let names: Vec<&str> = shipped.bindings.iter().map(|b| b.name.as_str()).collect();
                return Err(format!(
                    "its binding `{name}` is not a buffer of the program; the shipped pass binds \
                     {}",
                    names.join(", ")
                ));
            }
        }
        let of = |layouts: &[Layout]| -> Option<Layout> {
            let struct_name = binding.element.name.as_ref()?;
            layouts.iter().find(|l| l.name == *struct_name).cloned()
        };
        if let (Some(now), Some(before)) = (of(&edited.layouts), of(&shipped.layouts)) {
            same_layout(&now, &before)?;
        }
    }
    Ok(())
}

/// Checks that a binding has the kind and size that the program expects.
fn same_element(binding: &Binding, access: Access, known: &ElementType) -> Result<(), String> {
    let (name, now) = (&binding.name, &binding.element);
    let is_same_kind =
        binding.access == access || (binding.access.is_storage() && access.is_storage());
    if !is_same_kind {
        return Err(format!(
            "its binding `{name}` is {:?}, and the program has {access:?}",
            binding.access
        ));
    }
    if (now.stride, now.scalar, now.head) == (known.stride, known.scalar, known.head) {
        return Ok(());
    }
    let words = |of: &ElementType| {
        let head = match of.head {
            0 => String::new(),
            head => format!(" behind {head} bytes"),
        };
        format!("{} bytes of {:?}{head}", of.stride, of.scalar)
    };
    Err(format!(
        "an element of its binding `{name}` is {}, and the program has {}",
        words(now),
        words(known)
    ))
}

/// Checks that a struct's members have the offsets of the program's members of the same names.
fn same_layout(now: &Layout, before: &Layout) -> Result<(), String> {
    for (member, offset) in &now.members {
        let known = before.members.iter().find(|(name, _)| name == member);
        if let Some((_, known)) = known.filter(|(_, known)| known != offset) {
            return Err(format!(
                "member `{member}` of its struct {} begins at byte {offset}, and the program \
                 has it at byte {known}",
                now.name
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{
        super::{
            buffer::{BufferLayout, Scalar},
            reflect::reflect,
        },
        *,
    };

    const SHIPPED: &str = "struct Params { count: u32, step: f32, size: vec2f }\n\
        @group(0) @binding(0) var<uniform> params: Params;\n\
        @group(0) @binding(1) var<storage, read> velocity: array<vec4f>;\n\
        @compute @workgroup_size(64) fn main() {\n\
            let use_all = params.step * velocity[0].x;\n\
        }\n";

    /// Checks the shipped pass after text replacements.
    fn checked(edits: &[(&str, &str)]) -> Result<(), String> {
        let mut text = SHIPPED.to_owned();
        for (from, to) in edits {
            assert!(text.contains(from), "{from}");
            text = text.replace(from, to);
        }
        let buffer = |name: &str, is_uniform| BufferSpec {
            name: name.to_owned(),
            bytes: 64,
            is_uniform,
            is_windowed: false,
            element: BufferLayout {
                bytes: 16,
                scalar: Scalar::F32,
                head: 0,
            },
        };
        let buffers = [buffer("position", false), buffer("view", true)];
        let [now, before] = [text.as_str(), SHIPPED].map(|wgsl| reflect("pass", wgsl));
        check(&now.expect("valid"), &before.expect("valid"), &buffers)
    }

    #[test]
    fn what_the_program_cannot_bind_is_named() {
        for (edits, words) in [
            (
                &[("velocity", "velocities")][..],
                "`velocities` is not a buffer of the program; the shipped pass binds params, \
                 velocity",
            ),
            (
                &[("array<vec4f>", "array<vec2f>")],
                "`velocity` is 8 bytes of F32, and the program has 16",
            ),
            (&[("velocity", "view")], "`view` is Read, and"),
            (
                &[
                    ("array<vec4f>", "array<vec4u>"),
                    ("step * velocity[0].x", "step"),
                ],
                "16 bytes of U32",
            ),
            (
                &[("step: f32,", "step: f32, more: vec4f,")],
                "`params` is 48 bytes of Mixed, and the program has 16",
            ),
            (
                &[("count: u32, step: f32,", "step: f32, count: u32,")],
                "member `step` of its struct Params begins at byte 0, and the \
                 program has it at byte 4",
            ),
        ] {
            let said = checked(edits).expect_err(words);
            assert!(said.contains(words), "{said}");
        }
    }

    /// Controls: edits that keep the program's buffers.
    #[test]
    fn another_buffer_of_the_program_and_other_statements_are_fine() {
        for edits in [
            &[][..],
            &[("velocity", "position")],
            &[("params.step *", "2.0 * params.step *")],
            &[("count: u32", "number: u32")],
            &[("<storage, read>", "<storage, read_write>")],
        ] {
            assert_eq!(checked(edits), Ok(()));
        }
    }
}
