// Pixels of tiles with solids and without water: as for the picture, with DRY.
#import "ssfr/shade.wgsl"
