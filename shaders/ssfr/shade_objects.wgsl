// First visible objects of a sample: shade with OBJECTS.
#import "ssfr/shade.wgsl"
