// Whitewater for the additional channels: splat_whitewater with MOTION.
#import "ssfr/splat_whitewater.wgsl"
