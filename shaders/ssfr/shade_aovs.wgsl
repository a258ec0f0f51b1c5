// Additional channels: shade with AOVS.
#import "ssfr/shade.wgsl"
