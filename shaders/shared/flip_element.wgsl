// Elements of the cells around one cell. Its 3³ neighbourhood lies in at most eight bricks, on one
// side of its own brick along each axis. Their slots are looked up once; any neighbour's element
// then follows without a load.
#import "shared/bricks.wgsl"

var<private> own_local: vec3i;
// Slots of the own brick, the one on the x side, on the y side, and on both; then the same on the z
// side.
var<private> slots_near: vec4u;
var<private> slots_far: vec4u;

// Element of the cell at `offset`, each component from -4 to 4 after `open_neighborhood`, else from
// -1 to 1; in slot 0 if that brick is absent.
fn element_at(offset: vec3i) -> u32 {
    let cell = own_local + offset;
    // -1 and 8 have bit 3 set, 0 to 7 do not.
    let is_beyond = (cell & vec3i(8)) != vec3i(0);
    let of_z = select(slots_near, slots_far, is_beyond.z);
    let of_y = select(of_z.xy, of_z.zw, is_beyond.y);
    return select(of_y.x, of_y.y, is_beyond.x) * CELLS + local_index(vec3u(cell & vec3i(7)));
}
