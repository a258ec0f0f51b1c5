// Pixels of tiles without water: as for the picture, with DRY.
#import "ssfr/shade.wgsl"
