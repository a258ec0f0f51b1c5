// Calls the importing pass's visit(i, j) for every neighbour j of particle i: from the list that
// pbf/build_neighbors made if the plan has lists and this one is complete, else by searching the
// cells.
#import "shared/search.wgsl"
#ifdef NEIGHBOR_LIST
#import "shared/neighbor_list.wgsl"
@group(0) @binding(4) var<storage, read> neighbor_list: array<vec4u>;
@group(0) @binding(5) var<storage, read> neighbor_count: array<u32>;
#endif

fn for_each_neighbor(xi: vec3f, i: u32) {
#ifdef NEIGHBOR_LIST
    let count = neighbor_count[i];
    if count <= LIST_CAPACITY {
        let base = list_base(i);
        for (var k = 0u; k < count; k += 4u) {
            let four = neighbor_list[base + (k / 4u) * LIST_STRIDE];
            visit(i, four.x);
            visit(i, four.y);
            visit(i, four.z);
            visit(i, four.w);
        }
        return;
    }
#endif
    search_neighbors(xi, i);
}
