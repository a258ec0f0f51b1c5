// Spray for the additional channels: splat_spray with MOTION.
#import "ssfr/splat_spray.wgsl"
