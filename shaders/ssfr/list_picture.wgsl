// As list_tiles, with SOLIDS: what of the picture has water, solids, or neither.
#import "ssfr/list_tiles.wgsl"
