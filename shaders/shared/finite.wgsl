// Tests the bits: WGSL has no isnan that survives fast math.
fn is_finite(v: vec3f) -> bool {
    let exponent = vec3u(0x7f800000u);
    return all((bitcast<vec3u>(v) & exponent) != exponent);
}
