// Pixels of tiles with neither water nor solids: as for the picture, with DRY and BARE.
#import "ssfr/shade.wgsl"
