/* The shaders of the relief, WebGL 2: one quad that covers the pad.

Model: Lambert's law and a highlight, for one light. Slopes are scaled as in the pictures of the service
(synth/surfaces/lit_picture.py). A point is in shadow where the surface between it and the light is higher than the ray.
Where a finger and the texture overlap by h - z > 0 they touch; these patches are lit.
Limits: one shadow, no light that is reflected. The skin between patches is not simulated. */

export const MOST_FINGERS = 5;

export const VERTEX = `#version 300 es
void main() {
  gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0);
}`;

export const FRAGMENT = `#version 300 es
precision highp float;
precision highp sampler2D;
const int SHADOW_STEPS = 10;
const float BIAS = 0.8; // levels coarser than the pixel: means over squares leave stripes of ridges near two pixels
uniform sampler2D heights; // (height 0 to 1, slope x, slope y, mean square of the slopes)
uniform sampler2D skin; // heights of the finger over its length, m
uniform vec2 origin, size; // of the quad, device pixels
uniform vec2 period; // m
uniform float scale; // m per device pixel
uniform float low, span; // m: deepest height, and highest over deepest
uniform float gain; // by which slopes are scaled
uniform vec3 light; // its place: parts of the quad's size, and its height in quad heights
uniform vec3 material, ground, glow, flesh;
uniform int count;
uniform vec4 fingers[${MOST_FINGERS}]; // x, y (m), z (m), size of the footprint
uniform vec4 footprint; // begin, length, width (m), middle of the finger
uniform bool touching; // whether z of the fingers is known
out vec4 colour;

float shadowOf(vec2 place, float height, vec3 towards, float level) {
  float steep = towards.z / max(length(towards.xy), 1e-3);
  float reach = span * gain / steep;
  if (reach < 2.0 * scale) return 0.0;
  vec2 direction = normalize(towards.xy);
  float deepest = 0.0;
  for (int step = 1; step <= SHADOW_STEPS; step++) {
    float away = reach * float(step) / float(SHADOW_STEPS);
    float there = textureLod(heights, (place + direction * away) / period, level).r * span * gain;
    deepest = max(deepest, (there - height * span * gain - away * steep) / away);
  }
  return clamp(2.5 * deepest, 0.0, 1.0);
}

vec3 surface(vec2 place, vec2 part, out float level) {
  vec2 texel = vec2(textureSize(heights, 0)) / period * scale;
  level = max(0.0, log2(max(texel.x, texel.y)));
  vec4 here = texture(heights, place / period, BIAS);
  vec3 normal = normalize(vec3(-gain * here.gb, 1.0));
  vec3 towards = normalize(light - vec3(part, 0.0));
  float rough = sqrt(max(0.0, here.a - dot(here.gb, here.gb))) * gain;
  float hollow = here.r - textureLod(heights, place / period, level + 4.0).r;
  float open = clamp(0.88 + 0.35 * hollow * min(1.0, 1.6 * gain * span / (12.0 * scale)), 0.45, 1.1);
  float facing = max(dot(normal, towards), 0.0) * (1.0 - 0.6 * shadowOf(place, here.r, towards, level));
  vec3 halfway = normalize(towards + vec3(0.0, 0.0, 1.0));
  float sharp = mix(38.0, 6.0, clamp(rough, 0.0, 1.0));
  float shine = 0.22 * pow(max(dot(normal, halfway), 0.0), sharp) * facing / (1.0 + rough);
  vec3 base = mix(ground, material, 0.35 + 0.65 * here.r);
  float fall = clamp(1.2 - 0.3 * distance(light.xy, part), 0.6, 1.15);
  return base * open * (0.34 + 1.05 * facing * fall) + shine;
}

float skinAt(float along) {
  return texture(skin, vec2(clamp((along - footprint.x) / footprint.y, 0.0, 1.0), 0.5)).r;
}

/** Lays finger \`one\` over \`below\`. */
vec3 under(vec3 below, vec4 one, vec2 place, float level) {
  vec2 away = place - one.xy;
  vec2 extent = 0.5 * footprint.yz * one.w;
  float radius = length(away / extent);
  float body = length(away / (extent * 1.22));
  float shade = smoothstep(1.5, 0.9, length((away + vec2(-0.08, 0.12) * extent) / (extent * 1.22)));
  vec3 dark = below * (1.0 - 0.5 * shade);
  if (body > 1.0) return dark;
  vec3 bulge = normalize(vec3(away / extent * 0.75, sqrt(max(1.05 - body * body, 0.02))));
  float lit = 0.6 + 0.55 * max(dot(bulge, normalize(vec3(light.xy - 0.5, 0.9))), 0.0);
  float ridge = skinAt(away.x + footprint.w);
  float height = textureLod(heights, place / period, level).r * span + low;
  float overlap = touching ? height + ridge - one.z : -1.0;
  float pixel = fwidth(overlap) + 1e-9;
  float inside = smoothstep(1.04, 0.98, radius);
  float patch_ = smoothstep(-0.5 * pixel, 0.5 * pixel, overlap) * inside;
  vec3 seen = mix(dark * 0.9, flesh * lit, 0.5 + 0.3 * smoothstep(0.5, 1.0, body));
  seen += 0.16 * pow(max(bulge.z, 0.0), 24.0) * lit;
  seen = mix(seen, glow * (0.72 + 0.5 * lit), 0.78 * patch_);
  float edge = smoothstep(1.0, 0.965, body);
  return mix(dark, seen, edge);
}

void main() {
  vec2 inside = gl_FragCoord.xy - origin;
  vec2 place = vec2(inside.x, inside.y - 0.5 * size.y) * scale;
  float level;
  vec3 found = surface(place, inside / size.y, level);
  for (int index = 0; index < count; index++) found = under(found, fingers[index], place, level);
  colour = vec4(found, 1.0);
}`;
