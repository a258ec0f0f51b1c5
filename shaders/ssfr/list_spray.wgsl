// As list_tiles, with SPRAY: lists the tiles of a part of the frame that have spray.
#import "ssfr/list_tiles.wgsl"
