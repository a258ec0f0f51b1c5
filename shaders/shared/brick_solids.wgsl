// The solids that may cut a brick's cells: all that are no bodies, and the bodies of its pairs, in
// order.
@group(0) @binding(2) var<storage, read> body_pairs: array<BodyPair>;
@group(0) @binding(3) var<storage, read> body_states: array<DeviceBody>;

var<private> first_about: u32;
var<private> end_about: u32;

// Number of pairs.
fn pair_count() -> u32 {
    return body_states[arrayLength(&body_states) - 1u].end;
}

// Selects the brick of a pair, whose pairs follow one another.
fn look_about(pair: u32) {
    let slot = body_pairs[pair].slot;
    first_about = pair;
    while first_about > 0u && body_pairs[first_about - 1u].slot == slot {
        first_about -= 1u;
    }
    end_about = pair + 1u;
    while end_about < pair_count() && body_pairs[end_about].slot == slot {
        end_about += 1u;
    }
}

fn solids_about() -> u32 {
    return body_states[0].solid + end_about - first_about;
}

fn solid_about(index: u32) -> u32 {
    let others = body_states[0].solid;
    if index < others {
        return index;
    }
    return others + body_pairs[first_about + index - others].body;
}
