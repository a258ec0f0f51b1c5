// Sparse grids (src/domain/bricks.rs): cell `local` of slot `s` is element 512 s + local. Slot 0
// stands for absent bricks and holds zeros.
struct Brick {
    coordinate: array<u32, 3>,
    level: u32,
    neighbors: array<u32, 27>,
    parent: u32,
    children: array<u32, 8>,
}

const CELLS = 512u;

fn local_index(cell: vec3u) -> u32 {
    return cell.x + 8u * cell.y + 64u * cell.z;
}

fn local_cell(local: u32) -> vec3u {
    return vec3u(local & 7u, (local >> 3u) & 7u, local >> 6u);
}

// Index of the neighbour, among 27, that contains a cell; `cell` from -8 to 15 along each axis.
fn neighbor_of(cell: vec3i) -> u32 {
    let step = vec3u(cell + 8) >> vec3u(3u);
    return step.x + 3u * step.y + 9u * step.z;
}

// Index of such a cell within its own brick.
fn wrapped(cell: vec3i) -> u32 {
    return local_index(vec3u(cell + 8) & vec3u(7u));
}
