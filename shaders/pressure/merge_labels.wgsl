// Connected bodies of water across blocks: union-find in which the smaller root wins (Playne and
// Hawick 2018). The roots do not depend on the order in which the device runs threads.
#import "shared/pressure_links.wgsl"

@group(0) @binding(5) var<storage, read_write> pressure_label: array<atomic<u32>>;

// Exceeds the length of any chain of labels.
const MOST = 1u << 26u;

fn root_of(label: u32) -> u32 {
    var at = label;
    for (var step = 0u; step < MOST; step++) {
        let next = atomicLoad(&pressure_label[at]);
        if next == at {
            break;
        }
        at = next;
    }
    return at;
}

fn unite(a: u32, b: u32) {
    var x = root_of(a);
    var y = root_of(b);
    for (var step = 0u; step < MOST && x != y; step++) {
        let least = min(x, y);
        let most = max(x, y);
        let before = atomicMin(&pressure_label[most], least);
        // Another thread may have changed the root first: then its root has to be united with ours
        // as well.
        x = root_of(least);
        y = select(root_of(before), x, before == most);
    }
}

// Four pairs across one side of a block; a pair with the same labels as the previous one is the
// same union.
fn across(mine: vec4u, theirs: vec4u, coefficient: vec4r) {
    var last = vec2u(0u);
    for (var k = 0u; k < 4u; k++) {
        let a = atomicLoad(&pressure_label[mine[k]]);
        let b = atomicLoad(&pressure_label[theirs[k]]);
        if coefficient[k] > 0.0 && a != b && any(vec2u(a, b) != last) {
            unite(a, b);
            last = vec2u(a, b);
        }
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
    let lower = blocked_lower(s);
    let x = vec4u(0u, 128u, 256u, 384u);
    let y = vec4u(0u, 64u, 256u, 320u);
    let z = vec4u(0u, 64u, 128u, 192u);
    across(own + x, lower.x + 64u + x, l.out.xl);
    across(own + y, lower.y + 128u + y, l.out.yl);
    across(own + z, lower.z + 256u + z, l.out.zl);
}
