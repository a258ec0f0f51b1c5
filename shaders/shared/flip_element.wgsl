// Where the cells about one cell stand. Its 3³ neighbourhood lies in at most eight bricks, on one side of its own
// along each axis: their slots are looked up once, and any neighbour's element is then chosen without a load.
#import "shared/bricks.wgsl"

var<private> own_local: vec3i;
// Own brick, +x side, +y side, both; and the same on the z side.
var<private> slots_near: vec4u;
var<private> slots_far: vec4u;

// Element of the cell `offset` away, each of -1, 0, 1; in slot 0 where there is none.
fn element_at(offset: vec3i) -> u32 {
    let cell = own_local + offset;
    // -1 and 8 have bit 3, 0 to 7 do not.
    let is_beyond = (cell & vec3i(8)) != vec3i(0);
    let of_z = select(slots_near, slots_far, is_beyond.z);
    let of_y = select(of_z.xy, of_z.zw, is_beyond.y);
    return select(of_y.x, of_y.y, is_beyond.x) * CELLS + local_index(vec3u(cell & vec3i(7)));
}
