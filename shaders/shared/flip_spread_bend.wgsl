// Spreads the weight of the midpoint rule over the bricks around one. The shader that imports this
// defines `raise`, by which a slot gets at least the float of these bits (in the floats' order).
#import "shared/flip_cell.wgsl"

var<workgroup> most_of_group: atomic<u32>;

// `element` is that of the workgroup's thread `local`, all of one brick.
fn spread_bend(bend: f32, element: u32, local: u32) {
    if local == 0u {
        atomicStore(&most_of_group, 0u);
    }
    workgroupBarrier();
    atomicMax(&most_of_group, bitcast<u32>(bend));
    workgroupBarrier();
    let most = atomicLoad(&most_of_group);
    let slot = bricks[element / CELLS].neighbors[min(local, 26u)];
    if most > 0u && local < 27u && slot > 0u {
        raise(slot, most);
    }
}
