// Tiles with solids but no water: shade with DRY.
#import "ssfr/shade.wgsl"
