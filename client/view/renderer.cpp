#include "client/view/renderer.hpp"

#include <epoxy/gl.h>

#include <array>
#include <cstddef>
#include <stdexcept>
#include <string>

#include "client/view/shaders.hpp"

namespace tandem::client {
namespace {

constexpr int kShadowPixels = 2048, kFastShadowPixels = 1024;
/// Direction to the sun in the world.
const Vec3 kToSun = Vec3(-0.45, -0.55, 1.0).normalized();
/// Half width of the floor, in units of DrawnFrame::focus_radius_m.
constexpr double kFloorReach = 14;

using Mat4 = Eigen::Matrix4f;

std::string log_of(GLuint object, bool is_program) {
  std::array<char, 1024> text{};
  if (is_program) {
    glGetProgramInfoLog(object, text.size(), nullptr, text.data());
  } else {
    glGetShaderInfoLog(object, text.size(), nullptr, text.data());
  }
  return text.data();
}

GLuint compiled(GLenum kind, const std::string& source) {
  const GLuint shader = glCreateShader(kind);
  const char* text = source.c_str();
  glShaderSource(shader, 1, &text, nullptr);
  glCompileShader(shader);
  GLint is_good = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &is_good);
  if (is_good == 0) throw std::runtime_error("the window: a shader was refused: " + log_of(shader, false));
  return shader;
}

class Program {
 public:
  Program(const std::string& vertex, const std::string& fragment) : id_(glCreateProgram()) {
    const GLuint parts[] = {compiled(GL_VERTEX_SHADER, vertex), compiled(GL_FRAGMENT_SHADER, fragment)};
    for (const GLuint part : parts) glAttachShader(id_, part);
    glLinkProgram(id_);
    for (const GLuint part : parts) glDeleteShader(part);
    GLint is_good = 0;
    glGetProgramiv(id_, GL_LINK_STATUS, &is_good);
    if (is_good == 0) throw std::runtime_error("the window: shaders could not be linked: " + log_of(id_, true));
  }
  ~Program() { glDeleteProgram(id_); }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  void use() const { glUseProgram(id_); }
  GLint at(const char* name) const { return glGetUniformLocation(id_, name); }
  void set(const char* name, const Mat4& value) const { glUniformMatrix4fv(at(name), 1, GL_FALSE, value.data()); }
  void set(const char* name, const Vec3& value) const {
    const Eigen::Vector3f single = value.cast<float>();
    glUniform3fv(at(name), 1, single.data());
  }
  void set(const char* name, const Rgba& value) const { glUniform4fv(at(name), 1, value.data()); }
  void set(const char* name, double value) const { glUniform1f(at(name), static_cast<float>(value)); }

 private:
  GLuint id_;
};

/// Copy of a mesh in the memory of the graphics card: a vertex array object and its buffer.
class Buffers {
 public:
  explicit Buffers(const DrawnMesh& mesh) : count_(static_cast<GLsizei>(mesh.size())) {
    glGenVertexArrays(1, &array_);
    glGenBuffers(1, &buffer_);
    glBindVertexArray(array_);
    glBindBuffer(GL_ARRAY_BUFFER, buffer_);
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(mesh.size() * sizeof(Vertex)), mesh.data(), GL_STATIC_DRAW);
    attribute(0, 3, GL_FLOAT, GL_FALSE, offsetof(Vertex, position_m));
    attribute(1, 3, GL_FLOAT, GL_FALSE, offsetof(Vertex, normal));
    attribute(2, 4, GL_UNSIGNED_BYTE, GL_TRUE, offsetof(Vertex, color));
  }
  ~Buffers() {
    glDeleteVertexArrays(1, &array_);
    glDeleteBuffers(1, &buffer_);
  }
  Buffers(const Buffers&) = delete;
  Buffers& operator=(const Buffers&) = delete;

  void draw() const {
    glBindVertexArray(array_);
    glDrawArrays(GL_TRIANGLES, 0, count_);
  }

 private:
  static void attribute(GLuint index, GLint count, GLenum type, GLboolean is_share, std::size_t offset) {
    glEnableVertexAttribArray(index);
    const auto* const place =
        reinterpret_cast<const void*>(offset);  // NOLINT(performance-no-int-to-ptr): OpenGL passes it as a pointer
    glVertexAttribPointer(index, count, type, is_share, sizeof(Vertex), place);
  }

  GLsizei count_;
  GLuint array_ = 0;
  GLuint buffer_ = 0;
};

/// Returns a square from −1 to 1 along x and y, at z = 0, as two triangles.
DrawnMesh square() {
  DrawnMesh mesh;
  for (const auto& [x, y] : {std::pair(-1, -1), {1, -1}, {1, 1}, {-1, -1}, {1, 1}, {-1, 1}}) {
    mesh.push_back({{static_cast<float>(x), static_cast<float>(y), 0}, {0, 0, 1}, {255, 255, 255, 255}});
  }
  return mesh;
}

Mat4 matrix_of(const Pose& X) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.block<3, 3>(0, 0) = X.q.toRotationMatrix();
  matrix.block<3, 1>(0, 3) = X.p;
  return matrix.cast<float>();
}

/// Depth map of the scene as seen from the sun.
class ShadowMap {
 public:
  explicit ShadowMap(int pixels) : pixels_(pixels) {
    glGenTextures(1, &texture_);
    glBindTexture(GL_TEXTURE_2D, texture_);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT24, pixels, pixels, 0, GL_DEPTH_COMPONENT, GL_FLOAT, nullptr);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
    glGenFramebuffers(1, &frame_);
    glBindFramebuffer(GL_FRAMEBUFFER, frame_);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, texture_, 0);
    glDrawBuffer(GL_NONE);
    glReadBuffer(GL_NONE);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
  }
  ~ShadowMap() {
    glDeleteFramebuffers(1, &frame_);
    glDeleteTextures(1, &texture_);
  }
  ShadowMap(const ShadowMap&) = delete;
  ShadowMap& operator=(const ShadowMap&) = delete;

  void begin() const {
    glBindFramebuffer(GL_FRAMEBUFFER, frame_);
    glViewport(0, 0, pixels_, pixels_);
    glClear(GL_DEPTH_BUFFER_BIT);
  }
  void bind() const { glBindTexture(GL_TEXTURE_2D, texture_); }

 private:
  int pixels_;
  GLuint texture_ = 0;
  GLuint frame_ = 0;
};

}  // namespace

struct Renderer::Impl {
  explicit Impl(RenderQuality quality) : is_fast(quality == RenderQuality::kFast) {}

  void draw_shadows(const DrawnFrame& frame, const Mat4& sun) const;
  void draw_sky() const;
  void draw_floor(const DrawnFrame& frame, const Mat4& clip, const Mat4& sun, const Camera& camera) const;
  void draw_things(const DrawnFrame& frame, const Mat4& clip, const Mat4& sun, const Camera& camera, bool is_opaque,
                   bool are_marks) const;
  void place(const Program& program, const DrawnThing& thing) const {
    program.set("world_of_thing", matrix_of(thing.X_W));
    program.set("scale", thing.scale);
    meshes[thing.mesh]->draw();
  }

  const bool is_fast;
  const std::string light = std::string("#version 330 core\n") + (is_fast ? "#define FAST\n" : "") + kLight;
  Program things{kThingVertexShader, light + kThingFragmentShader};
  Program shadows{kShadowVertexShader, kShadowFragmentShader};
  Program floor{kFloorVertexShader, light + kFloorFragmentShader};
  Program sky{kSkyVertexShader, kSkyFragmentShader};
  ShadowMap shadow_map{is_fast ? kFastShadowPixels : kShadowPixels};
  Buffers square_buffers{square()};
  std::vector<std::unique_ptr<Buffers>> meshes;
};

void Renderer::Impl::draw_shadows(const DrawnFrame& frame, const Mat4& sun) const {
  shadow_map.begin();
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_TRUE);
  shadows.use();
  shadows.set("clip_of_world", sun);
  // Adds an offset to the depth in proportion to the slope, so that no surface casts a shadow on itself.
  glEnable(GL_POLYGON_OFFSET_FILL);
  glPolygonOffset(2.0F, 4.0F);
  for (const DrawnThing& thing : frame.things) {
    if (!thing.is_mark && thing.tint[3] >= 1) place(shadows, thing);
  }
  glDisable(GL_POLYGON_OFFSET_FILL);
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
}

void Renderer::Impl::draw_sky() const {
  glDisable(GL_DEPTH_TEST);
  sky.use();
  square_buffers.draw();
  glEnable(GL_DEPTH_TEST);
}

void Renderer::Impl::draw_floor(const DrawnFrame& frame, const Mat4& clip, const Mat4& sun,
                                const Camera& camera) const {
  floor.use();
  floor.set("clip_of_world", clip);
  floor.set("sun_of_world", sun);
  floor.set("eye", camera.eye_W());
  floor.set("to_sun", kToSun);
  floor.set("centre", Vec3(frame.focus_W.x(), frame.focus_W.y(), frame.floor_z_m));
  floor.set("reach", kFloorReach * frame.focus_radius_m);
  floor.set("grid", frame.grid_m);
  square_buffers.draw();
}

void Renderer::Impl::draw_things(const DrawnFrame& frame, const Mat4& clip, const Mat4& sun, const Camera& camera,
                                 bool is_opaque, bool are_marks) const {
  things.use();
  things.set("clip_of_world", clip);
  things.set("sun_of_world", sun);
  things.set("eye", camera.eye_W());
  things.set("to_sun", kToSun);
  const bool is_cut = frame.cut_W && !are_marks;
  const Eigen::Vector4d cut_W = is_cut ? Eigen::Vector4d(frame.cut_W->coeffs()) : Eigen::Vector4d(0, 0, 0, 1);
  const Eigen::Vector4f cut = cut_W.cast<float>();
  things.set("cut", Rgba{cut.x(), cut.y(), cut.z(), cut.w()});
  glEnable(GL_CLIP_DISTANCE0);
  for (const DrawnThing& thing : frame.things) {
    if ((thing.tint[3] >= 1) != is_opaque || thing.is_mark != are_marks) continue;
    things.set("tint", thing.tint);
    things.set("glow", thing.glow);
    place(things, thing);
  }
  glDisable(GL_CLIP_DISTANCE0);
}

Renderer::Renderer(RenderQuality quality) : impl_(std::make_unique<Impl>(quality)) {
  if (quality == RenderQuality::kFull) glEnable(GL_MULTISAMPLE);
  glDepthFunc(GL_LEQUAL);
}

Renderer::~Renderer() = default;

std::size_t Renderer::add_mesh(const DrawnMesh& mesh) {
  impl_->meshes.push_back(std::make_unique<Buffers>(mesh));
  return impl_->meshes.size() - 1;
}

void Renderer::replace_mesh(std::size_t mesh, const DrawnMesh& by) {
  if (mesh < impl_->meshes.size()) impl_->meshes[mesh] = std::make_unique<Buffers>(by);
}

void Renderer::remove_meshes_from(std::size_t mesh) {
  if (mesh < impl_->meshes.size()) impl_->meshes.resize(mesh);
}

void Renderer::draw(const DrawnFrame& frame, const Camera& camera, int width, int height) {
  const Mat4 sun = projection_of_sun(-kToSun, frame.focus_W, 2.2 * frame.focus_radius_m);
  impl_->draw_shadows(frame, sun);
  glViewport(0, 0, width, height);
  glClearColor(0, 0, 0, 1);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  impl_->draw_sky();
  impl_->shadow_map.bind();
  const Mat4 clip = camera.projection_of_world(static_cast<double>(width) / std::max(1, height));
  impl_->draw_things(frame, clip, sun, camera, true, false);
  glEnable(GL_BLEND);
  glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  impl_->draw_floor(frame, clip, sun, camera);
  glDepthMask(GL_FALSE);
  glEnable(GL_CULL_FACE);
  impl_->draw_things(frame, clip, sun, camera, false, false);
  glDisable(GL_CULL_FACE);
  glDepthMask(GL_TRUE);
  glClear(GL_DEPTH_BUFFER_BIT);
  impl_->draw_things(frame, clip, sun, camera, true, true);
  impl_->draw_things(frame, clip, sun, camera, false, true);
  glDisable(GL_BLEND);
}

std::vector<std::uint8_t> Renderer::pixels(int width, int height) {
  std::vector<std::uint8_t> upwards(static_cast<std::size_t>(width) * height * 3);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width, height, GL_RGB, GL_UNSIGNED_BYTE, upwards.data());
  std::vector<std::uint8_t> result;
  const std::size_t row = static_cast<std::size_t>(width) * 3;
  for (std::size_t y = upwards.size(); y >= row && row > 0; y -= row) {
    result.insert(result.end(), upwards.begin() + static_cast<std::ptrdiff_t>(y - row),
                  upwards.begin() + static_cast<std::ptrdiff_t>(y));
  }
  return result;
}

std::string Renderer::driver() {
  const GLubyte* const name = glGetString(GL_RENDERER);
  return name == nullptr ? "unknown" : reinterpret_cast<const char*>(name);
}

}  // namespace tandem::client
