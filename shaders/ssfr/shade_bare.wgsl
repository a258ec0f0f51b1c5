// Tiles with neither water nor solids: shade with DRY and BARE.
#import "ssfr/shade.wgsl"
