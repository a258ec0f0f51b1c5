// Fractions of a unit square cut by a plane, from values at its corners.

// Fraction of the square where c + gx x + gy y > 0, x and y from -1/2 to 1/2; exact. `slopes` are
// |gx| and |gy|.
fn open_area(c: f32, slopes: vec2f) -> f32 {
    let steep = max(slopes.x, slopes.y);
    let flat = min(slopes.x, slopes.y);
    let far = max(0.5 * (steep + flat) - abs(c), 0.0);
    // Beyond the linear range only a corner is left, a triangle.
    let corner = far * far / max(2.0 * steep * flat, 1e-20);
    let stretch = 0.5 - abs(c) / max(steep, 1e-20);
    let smaller = select(corner, stretch, abs(c) <= 0.5 * (steep - flat));
    return select(smaller, 1.0 - smaller, c > 0.0);
}

// Corners in the order (0,0), (1,0), (0,1), (1,1).
fn open_part(corners: vec4f) -> f32 {
    let x = 0.5 * (corners.y + corners.w - corners.x - corners.z);
    let y = 0.5 * (corners.z + corners.w - corners.x - corners.y);
    return open_area(dot(corners, vec4f(0.25)), abs(vec2f(x, y)));
}
