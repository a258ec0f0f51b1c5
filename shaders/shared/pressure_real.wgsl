// Precision of the projection: solver.flip.pressure.precision.
#ifdef F64
alias real = f64;
#else
alias real = f32;
#endif
alias vec3r = vec3<real>;
alias vec4r = vec4<real>;
