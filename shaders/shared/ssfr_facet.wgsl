// Microgeometry of the water's surface within a pixel. The importing shader must bind `camera` and
// `shading`.
#import "shared/ssfr_light.wgsl"
#ifdef RIPPLES
#import "shared/ssfr_ripple.wgsl"
#endif

// Outward normal with ripples, and the mean square slope of ripples that a pixel cannot resolve.
struct Facet {
    normal: vec3f,
    variance: f32,
}

fn facet_at(p: vec3f, normal: vec3f, footprint: f32) -> Facet {
    let plain = Facet(normalize(normal), shading.roughness * shading.roughness);
#ifdef RIPPLES
    let ripple = ripple_at(p.xz, camera.clock, shading.ripple.x, shading.ripple.y, footprint);
    // Ripples act on surfaces that face up.
    let rides = smoothstep(0.2, 0.8, normal.y);
    let turned = normalize(normal - vec3f(ripple.slope.x, 0.0, ripple.slope.y) * rides);
    return Facet(turned, plain.variance + ripple.lost * rides);
#else
    return plain;
#endif
}
