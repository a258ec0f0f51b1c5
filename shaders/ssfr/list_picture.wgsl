// As list_tiles, with SOLIDS: sorts the picture's tiles into water, solids and neither.
#import "ssfr/list_tiles.wgsl"
