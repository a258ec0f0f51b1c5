// Refraction of the view by a sheet of water. The importing shader must bind `camera`, `shading`
// and `solid_depth`, and have `thickness_at` and `Behind`.
#import "shared/ssfr_slope.wgsl"

// Pixel at which the line of sight through a sheet of water meets what is behind it. A thin prism
// deflects light by n − 1 times its angle (Born and Wolf, Principles of Optics, 4.7.2), which is
// the slope of the thickness. Where the result is in front of the sheet, the ray continues
// straight.
fn through_sheet(pixel: vec2i, z: f32, straight: Behind) -> vec2i {
    let p = vec2f(pixel) + 0.5;
    let h = spacing_in_pixels(z);
    let a = thickness_at(p + vec2f(h, h));
    let b = thickness_at(p + vec2f(h, -h));
    let c = thickness_at(p + vec2f(-h, h));
    let d = thickness_at(p - vec2f(h, h));
    let slope = slope_between(a, b, c, d, h, z);
    let steep = max(length(slope), 1e-6);
    let turn = tan((shading.index - 1.0) * atan(steep)) * (1.0 - z / straight.depth);
    let aside = vec2i(floor(0.5 + slope / steep * turn * camera.focal));
    let bent = clamp(pixel + aside, vec2i(0), vec2i(camera.size) - 1);
    return select(bent, pixel, solid_depth[u32(bent.y) * camera.size.x + u32(bent.x)] < z);
}
