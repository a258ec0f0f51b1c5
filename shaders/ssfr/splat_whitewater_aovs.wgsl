// Whitewater for the channels that stand beside the picture: as for the picture, with MOTION.
#import "ssfr/splat_whitewater.wgsl"
