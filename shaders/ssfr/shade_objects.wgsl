// What a sample sees first: as the picture is shaded, with OBJECTS.
#import "ssfr/shade.wgsl"
