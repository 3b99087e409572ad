// The shaders (GLSL 3.30) of renderer.cpp.
#pragma once

namespace tandem::client {

inline constexpr const char* kThingVertexShader = R"(#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 color;
uniform mat4 clip_of_world, sun_of_world, world_of_thing;
uniform vec3 scale;
uniform vec4 cut;
out vec3 at, up;
out vec4 paint, in_sun;
void main() {
  vec4 world = world_of_thing * vec4(position * scale, 1.0);
  at = world.xyz;
  up = mat3(world_of_thing) * (normal / scale);
  paint = color;
  in_sun = sun_of_world * world;
  gl_Position = clip_of_world * world;
  gl_ClipDistance[0] = dot(cut, world);
})";

// Lighting. It is computed with linear intensities, which are displayed with gamma 2.2 (2 if FAST is defined). There
// are three lights: the sky from above, weak light of the ground from below, and a sun with a small highlight. The
// sun's shadow is filtered over 3 x 3 samples of the shadow map (over the four texels of one sample if FAST is
// defined).
inline constexpr const char* kLight = R"(
uniform vec3 eye, to_sun;
uniform sampler2DShadow shadow_map;
float sunlit(vec4 in_sun, float slope) {
  vec3 p = in_sun.xyz * 0.5 + 0.5;
  if (any(lessThan(p, vec3(0.0))) || any(greaterThan(p, vec3(1.0)))) return 1.0;
  float texel = 1.0 / float(textureSize(shadow_map, 0).x);
  float bias = texel * (0.6 + 1.6 * slope);
#ifdef FAST
  return texture(shadow_map, vec3(p.xy, p.z - bias));
#else
  float sum = 0.0;
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y) sum += texture(shadow_map, vec3(p.xy + vec2(x, y) * texel, p.z - bias));
  return sum / 9.0;
#endif
}
#ifdef FAST
vec3 linear(vec3 paint) { return paint * paint; }
vec3 shown(vec3 light) { return sqrt(clamp(light, 0.0, 1.0)); }
#else
vec3 linear(vec3 paint) { return pow(paint, vec3(2.2)); }
vec3 shown(vec3 light) { return pow(min(light, vec3(1.0)), vec3(1.0 / 2.2)); }
#endif
vec3 lit(vec3 paint, vec3 at, vec3 n, vec4 in_sun) {
  vec3 albedo = linear(paint);
  float facing = max(dot(n, to_sun), 0.0);
  float sun = facing * sunlit(in_sun, 1.0 - facing);
  vec3 sky = mix(vec3(0.16, 0.15, 0.14), vec3(0.50, 0.54, 0.60), 0.5 + 0.5 * n.z);
  vec3 view = normalize(eye - at);
  float shine = pow(max(dot(n, normalize(view + to_sun)), 0.0), 40.0) * sun;
  float rim = pow(1.0 - max(dot(n, view), 0.0), 4.0);
  return albedo * (sky + sun * vec3(0.98, 0.93, 0.84)) + vec3(0.10) * shine + 0.06 * rim * sky;
}
)";

inline constexpr const char* kThingFragmentShader = R"(
in vec3 at, up;
in vec4 paint, in_sun;
uniform vec4 tint;
uniform float glow;
out vec4 pixel;
void main() {
  vec3 n = normalize(up);
  if (!gl_FrontFacing) n = -n;
  // With multisampling, the interpolated colour at the edge of a triangle may lie outside the range 0 to 1.
  vec4 own = clamp(paint, 0.0, 1.0) * tint;
  vec3 light = mix(lit(own.rgb, at, n, in_sun), linear(own.rgb), glow);
  pixel = vec4(shown(light), own.a);
})";

inline constexpr const char* kShadowVertexShader = R"(#version 330 core
layout(location = 0) in vec3 position;
uniform mat4 clip_of_world, world_of_thing;
uniform vec3 scale;
void main() { gl_Position = clip_of_world * world_of_thing * vec4(position * scale, 1.0); })";

inline constexpr const char* kShadowFragmentShader = R"(#version 330 core
void main() {})";

inline constexpr const char* kFloorVertexShader = R"(#version 330 core
layout(location = 0) in vec3 position;
uniform mat4 clip_of_world, sun_of_world;
uniform vec3 centre;
uniform float reach;
out vec3 at;
out vec4 in_sun;
void main() {
  at = centre + position * reach;
  in_sun = sun_of_world * vec4(at, 1.0);
  gl_Position = clip_of_world * vec4(at, 1.0);
})";

// The floor: its grid lines are about one pixel wide, and it fades into the background with the distance.
inline constexpr const char* kFloorFragmentShader = R"(
in vec3 at;
in vec4 in_sun;
uniform vec3 centre;
uniform float reach, grid;
out vec4 pixel;
float line(vec2 p) {
  vec2 wide = fwidth(p);
  vec2 near = abs(fract(p - 0.5) - 0.5) / max(wide, vec2(1e-6));
  float strength = clamp(1.3 - min(near.x, near.y), 0.0, 1.0);
  return strength * clamp(1.5 - 2.5 * max(wide.x, wide.y), 0.0, 1.0);
}
void main() {
  vec3 ground = vec3(0.30, 0.33, 0.37);
  float lines = max(0.35 * line(at.xy / grid), 0.6 * line(at.xy / (5.0 * grid)));
  vec3 light = lit(mix(ground, vec3(0.55, 0.59, 0.64), lines), at, vec3(0, 0, 1), in_sun);
  float far = length(at.xy - centre.xy) / reach;
  pixel = vec4(shown(light), 1.0 - smoothstep(0.35, 1.0, far));
})";

inline constexpr const char* kSkyVertexShader = R"(#version 330 core
layout(location = 0) in vec3 position;
out float height;
void main() {
  height = position.y;
  gl_Position = vec4(position.xy, 1.0, 1.0);
})";

inline constexpr const char* kSkyFragmentShader = R"(#version 330 core
in float height;
out vec4 pixel;
void main() {
  vec3 color = mix(vec3(0.20, 0.23, 0.27), vec3(0.42, 0.47, 0.53), smoothstep(-1.0, 1.0, height));
  pixel = vec4(color, 1.0);
})";

}  // namespace tandem::client
