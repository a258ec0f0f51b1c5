// Which tiles of a part of the frame have spray: as for water, with SPRAY.
#import "ssfr/list_tiles.wgsl"
