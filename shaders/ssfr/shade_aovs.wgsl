// The channels that stand beside the picture: as the picture is shaded, with AOVS.
#import "ssfr/shade.wgsl"
