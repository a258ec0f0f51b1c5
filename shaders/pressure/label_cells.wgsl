// Connected bodies of water, first within each block: a label is the smallest element of the
// connected cells, and 0 if air touches the cell or it has no row.
#import "shared/pressure_links.wgsl"

@group(0) @binding(5) var<storage, read_write> pressure_label: array<u32>;

fn join(labels: ptr<function, array<u32, 8>>, a: u32, b: u32, coefficient: real) {
    let least = min((*labels)[a], (*labels)[b]);
    if coefficient > 0.0 {
        (*labels)[a] = least;
        (*labels)[b] = least;
    }
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    let range = phase.levels[0];
    if i / 64u >= range.y {
        return;
    }
    let s = site_at(range.x + i / 64u, i & 63u, range.x + range.y - 1u);
    let l = links_at(s);
    let own = blocked(s.slot, s.block);
    let rows = pressure_block[64u * s.slot + s.block] >> 8u;
    var labels: array<u32, 8>;
    for (var c = 0u; c < 8u; c++) {
        let air = select(l.dirichlet.lo[c & 3u], l.dirichlet.hi[c & 3u], c >= 4u);
        labels[c] = select(0u, own + 64u * c, ((rows >> c) & 1u) == 1u && air == 0.0);
    }
    // The longest path through a block has 7 steps; each round propagates in both directions along
    // at least two axes.
    for (var round = 0u; round < 7u; round++) {
        join(&labels, 0u, 1u, l.ix.x);
        join(&labels, 2u, 3u, l.ix.y);
        join(&labels, 4u, 5u, l.ix.z);
        join(&labels, 6u, 7u, l.ix.w);
        join(&labels, 0u, 2u, l.iy.x);
        join(&labels, 1u, 3u, l.iy.y);
        join(&labels, 4u, 6u, l.iy.z);
        join(&labels, 5u, 7u, l.iy.w);
        join(&labels, 0u, 4u, l.iz.x);
        join(&labels, 1u, 5u, l.iz.y);
        join(&labels, 2u, 6u, l.iz.z);
        join(&labels, 3u, 7u, l.iz.w);
    }
    for (var c = 0u; c < 8u; c++) {
        pressure_label[own + 64u * c] = labels[c];
    }
}
