//! Blocks within the statements of naga's intermediate representation.

use naga::{Block, Statement};

/// Applies `rewrite` to each block that a statement contains.
pub(super) fn nested_blocks(statement: &mut Statement, rewrite: &mut dyn FnMut(&mut Block)) {
    match statement {
        Statement::Block(block) => rewrite(block),
        Statement::If { accept, reject, .. } => {
            rewrite(accept);
            rewrite(reject);
        }
        Statement::Switch { cases, .. } => {
            cases.iter_mut().for_each(|case| rewrite(&mut case.body));
        }
        Statement::Loop {
            body, continuing, ..
        } => {
            rewrite(body);
            rewrite(continuing);
        }
        _ => {}
    }
}
