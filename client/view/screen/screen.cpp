#include "client/view/screen/screen.hpp"

#include <epoxy/gl.h>
// This header must follow the header of the OpenGL functions, which it would otherwise declare a second time.
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <thread>
#include <utility>

#include "client/view/png_file.hpp"
#include "client/view/renderer.hpp"
#include "client/view/screen/style.hpp"
#include "common/base/time.hpp"

namespace tandem::client {
namespace {

constexpr Duration kFramePeriod = std::chrono::microseconds(16'667);
constexpr Duration kSoftwareFramePeriod = std::chrono::microseconds(33'333);
/// Longest pause after a frame that was rendered on the processor. Pauses are needed because the haptic loop and a
/// local server use the same processors.
constexpr Duration kMaxPause = std::chrono::milliseconds(80);
constexpr Duration kDoubleClick = std::chrono::milliseconds(500);
constexpr double kDoubleClickPixels = 8;
constexpr std::size_t kMaxKeys = 32, kMaxDropped = 16;

/// Returns GLFW's last error text.
std::string glfw_problem() {
  const char* words = nullptr;
  glfwGetError(&words);
  return words == nullptr ? "" : std::string(words);
}

/// Opens a hidden window with `samples` samples per pixel, and makes its context current.
GLFWwindow* open_hidden(const ScreenSettings& settings, int samples) {
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_SAMPLES, samples);
  glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);
  glfwWindowHint(GLFW_SCALE_TO_MONITOR, GLFW_TRUE);
  GLFWwindow* const window =
      glfwCreateWindow(settings.width, settings.height, settings.title.c_str(), nullptr, nullptr);
  if (window == nullptr) {
    const std::string why = glfw_problem();
    glfwTerminate();
    throw std::runtime_error("no window with OpenGL 3.3 can be opened (" + why + "); add --headless");
  }
  glfwMakeContextCurrent(window);
  return window;
}

bool is_software(const std::string& driver) {
  return driver.find("llvmpipe") != std::string::npos || driver.find("softpipe") != std::string::npos;
}

/// Opens the window and selects the render quality. The number of samples per pixel must be chosen before a window is
/// opened, but the driver is known only afterwards. So the window is first opened with one sample per pixel. If the
/// driver is not a software renderer, the window is closed and opened again with four samples.
std::pair<GLFWwindow*, RenderQuality> open_window(const ScreenSettings& settings) {
  if (glfwInit() == GLFW_FALSE) {
    throw std::runtime_error("no window can be opened: no display (" + glfw_problem() + "); add --headless");
  }
  GLFWwindow* window = open_hidden(settings, 0);
  const bool is_fast = is_software(Renderer::driver()) && !settings.is_for_picture;
  if (!is_fast) {
    glfwDestroyWindow(window);
    window = open_hidden(settings, 4);
  }
  // Vertical synchronisation is off, because it would block while the window is hidden. FramePacer limits the rate.
  glfwSwapInterval(0);
  glfwShowWindow(window);
  return {window, is_fast ? RenderQuality::kFast : RenderQuality::kFull};
}

/// Limits the frame rate. Without a graphics card, also adds a pause after each frame. The pause is as long as the
/// frame took, at most kMaxPause.
class FramePacer {
 public:
  explicit FramePacer(RenderQuality quality) : is_fast_(quality == RenderQuality::kFast) {}
  /// Waits until the next frame is due. The frame begins when the function returns.
  void wait(const Clock& clock) {
    const LocalTime ended = clock.now();
    const Duration pause = is_fast_ ? std::min(ended - begun_, kMaxPause) : Duration{};
    const LocalTime due = std::max(begun_ + (is_fast_ ? kSoftwareFramePeriod : kFramePeriod), ended + pause);
    std::this_thread::sleep_for(due - ended);
    begun_ = clock.now();
  }

 private:
  bool is_fast_;
  LocalTime begun_{};
};

/// Detects double clicks by the times of the click events. Counting the clicks of each frame would fail at a low frame
/// rate, because both clicks may occur within one frame.
class DoubleClick {
 public:
  /// Adds a click at a position in pixels.
  void add(LocalTime now, const Eigen::Vector2d& at) {
    const bool is_second = now - clicked_at_ < kDoubleClick && (at - clicked_).norm() < kDoubleClickPixels;
    is_complete_ = is_complete_ || is_second;
    clicked_at_ = is_second ? LocalTime{} : now;
    clicked_ = at;
  }
  /// Returns true if a double click was completed since the last call.
  bool pop() { return std::exchange(is_complete_, false); }

 private:
  bool is_complete_ = false;
  LocalTime clicked_at_{};  ///< time of the last click; clicked_ is its position
  Eigen::Vector2d clicked_ = Eigen::Vector2d::Zero();
};

}  // namespace

struct Screen::Impl {
  explicit Impl(const ScreenSettings& settings);
  ~Impl();

  static Impl& of(GLFWwindow* window) { return *static_cast<Impl*>(glfwGetWindowUserPointer(window)); }
  static void note_key(GLFWwindow* window, int key, int, int action, int modifiers);
  static void note_button(GLFWwindow* window, int button, int action, int);
  static void note_dropped(GLFWwindow* window, int count, const char** files);
  void save_picture();

  std::pair<GLFWwindow*, RenderQuality> opened;
  GLFWwindow* window = opened.first;
  SteadyClock clock;
  FramePacer pacer{opened.second};
  int width = 0;  ///< width of the frame buffer [pixels]
  int height = 0;
  std::filesystem::path picture;  ///< file in which the next frame is saved; empty: not saved
  bool is_scene_only = false;     ///< true: the saved picture contains no texts and panels
  std::vector<int> keys;          ///< keys that were pressed since the last call of take_keys(), see there
  DoubleClick double_click;
  std::vector<std::filesystem::path> dropped;
  std::array<int, 4> windowed{};  ///< position and size that the window had before it became full screen
};

Screen::Impl::Impl(const ScreenSettings& settings) : opened(open_window(settings)) {
  float scale = 1, scale_y = 1;
  glfwGetWindowContentScale(window, &scale, &scale_y);
  glfwSetWindowUserPointer(window, this);
  // These callbacks must be set before those of ImGui, because ImGui's callbacks call the previously installed ones.
  glfwSetKeyCallback(window, note_key);
  glfwSetMouseButtonCallback(window, note_button);
  glfwSetDropCallback(window, note_dropped);
  ImGui::CreateContext();
  apply_style(std::clamp(scale, 0.5F, 4.0F));
  ImGui_ImplGlfw_InitForOpenGL(window, true);
  ImGui_ImplOpenGL3_Init("#version 330 core");
}

Screen::Impl::~Impl() {
  ImGui_ImplOpenGL3_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
  glfwDestroyWindow(window);
  glfwTerminate();
}

void Screen::Impl::note_key(GLFWwindow* window, int key, int, int action, int modifiers) {
  Impl& self = of(window);
  if (key == GLFW_KEY_Q && (modifiers & GLFW_MOD_CONTROL) != 0) glfwSetWindowShouldClose(window, GLFW_TRUE);
  if (action == GLFW_PRESS && self.keys.size() < kMaxKeys) self.keys.push_back(key);
}

void Screen::Impl::note_button(GLFWwindow* window, int button, int action, int) {
  Impl& self = of(window);
  if (button != GLFW_MOUSE_BUTTON_LEFT || action != GLFW_PRESS) return;
  Eigen::Vector2d at;
  glfwGetCursorPos(window, &at.x(), &at.y());
  self.double_click.add(self.clock.now(), at);
}

void Screen::Impl::note_dropped(GLFWwindow* window, int count, const char** files) {
  Impl& self = of(window);
  for (int i = 0; i < count && self.dropped.size() < kMaxDropped; ++i) self.dropped.emplace_back(files[i]);
}

void Screen::Impl::save_picture() {
  const std::filesystem::path file = std::exchange(picture, {});
  write_png(file, Renderer::pixels(width, height), width, height);
}

Screen::Screen(const ScreenSettings& settings) : impl_(std::make_unique<Impl>(settings)) {}

Screen::~Screen() = default;

void Screen::begin_frame() {
  impl_->pacer.wait(impl_->clock);
  glfwPollEvents();
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
  glfwGetFramebufferSize(impl_->window, &impl_->width, &impl_->height);
}

void Screen::end_frame() {
  Impl& self = *impl_;
  ImGui::Render();
  if (!self.picture.empty() && self.is_scene_only) self.save_picture();
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  if (!self.picture.empty()) self.save_picture();
  glfwSwapBuffers(self.window);
}

int Screen::width() const {
  return impl_->width;
}

int Screen::height() const {
  return impl_->height;
}

GLFWwindow* Screen::handle() const {
  return impl_->window;
}

RenderQuality Screen::quality() const {
  return impl_->opened.second;
}

void Screen::set_title(const std::string& title) {
  glfwSetWindowTitle(impl_->window, title.c_str());
}

std::vector<int> Screen::take_keys() {
  return std::exchange(impl_->keys, {});
}

bool Screen::pop_double_click() {
  return impl_->double_click.pop();
}

std::vector<std::filesystem::path> Screen::take_dropped() {
  return std::exchange(impl_->dropped, {});
}

bool Screen::is_closed() const {
  return glfwWindowShouldClose(impl_->window) != GLFW_FALSE;
}

void Screen::close() {
  glfwSetWindowShouldClose(impl_->window, GLFW_TRUE);
}

void Screen::toggle_full_screen() {
  auto& [x, y, width, height] = impl_->windowed;
  GLFWwindow* const window = impl_->window;
  if (glfwGetWindowMonitor(window) != nullptr) return glfwSetWindowMonitor(window, nullptr, x, y, width, height, 0);
  GLFWmonitor* const monitor = glfwGetPrimaryMonitor();
  const GLFWvidmode* const mode = monitor == nullptr ? nullptr : glfwGetVideoMode(monitor);
  if (mode == nullptr) return;
  glfwGetWindowPos(window, &x, &y);
  glfwGetWindowSize(window, &width, &height);
  glfwSetWindowMonitor(window, monitor, 0, 0, mode->width, mode->height, mode->refreshRate);
}

void Screen::save_next_frame(const std::filesystem::path& file, bool is_scene_only) {
  impl_->picture = file;
  impl_->is_scene_only = is_scene_only;
}

}  // namespace tandem::client
