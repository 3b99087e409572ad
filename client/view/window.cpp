// See window.hpp.
#include "client/view/window.hpp"

#include <epoxy/gl.h>
// Must follow the header of the OpenGL functions; otherwise it would declare them itself.
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <thread>

#include "client/view/goal_panel.hpp"
#include "client/view/panels.hpp"
#include "client/view/png_file.hpp"
#include "client/view/pointer_hand.hpp"
#include "client/view/scene_view.hpp"
#include "client/view/window_memory.hpp"

namespace tandem::client {
namespace {

constexpr const char* kFont = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf";
constexpr float kFontPixels = 14;
constexpr Duration kFramePeriod = std::chrono::microseconds(16'667);
constexpr Duration kSoftwareFramePeriod = std::chrono::microseconds(33'333);
/// Motion of the hand for a wheel step, and for an arrow key per second, as fractions of the window's height.
constexpr double kWheelShare = 0.02;
constexpr double kKeyShare_per_s = 0.25;
/// Rotation of the hand for a mouse motion across the window's height.
constexpr double kHandTurn_rad = 3;
constexpr double kWheelTurn_rad = 0.08;
constexpr Duration kDoubleClick = std::chrono::milliseconds(500);
constexpr double kDoubleClickPixels = 8;
/// Pose of the cap of a 3D mouse at full deflection.
constexpr double kCapReach_m = 0.04, kCapReach_rad = 0.5;

/// Returns GLFW's last error text.
std::string glfw_problem() {
  const char* words = nullptr;
  glfwGetError(&words);
  return words == nullptr ? "" : std::string(words);
}

GLFWwindow* open_window(const WindowSettings& settings) {
  if (glfwInit() == GLFW_FALSE) {
    throw std::runtime_error("no window can be opened: no display (" + glfw_problem() + "); add --headless");
  }
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_SAMPLES, 4);
  glfwWindowHint(GLFW_SCALE_TO_MONITOR, GLFW_TRUE);
  GLFWwindow* const window =
      glfwCreateWindow(settings.width, settings.height, settings.title.c_str(), nullptr, nullptr);
  if (window == nullptr) {
    const std::string why = glfw_problem();
    glfwTerminate();
    throw std::runtime_error("no window with OpenGL 3.3 can be opened (" + why + "); add --headless");
  }
  glfwMakeContextCurrent(window);
  // Frames are paced by FramePacer: a hidden window must not wait for the screen.
  glfwSwapInterval(0);
  return window;
}

void set_style(float scale) {
  ImGui::StyleColorsDark();
  ImGuiStyle& style = ImGui::GetStyle();
  style.WindowRounding = 6;
  style.FrameRounding = 3;
  style.WindowBorderSize = 0;
  style.Colors[ImGuiCol_WindowBg] = {0.09F, 0.11F, 0.13F, 0.86F};
  style.Colors[ImGuiCol_FrameBg] = {0.17F, 0.20F, 0.24F, 0.90F};
  style.Colors[ImGuiCol_Header] = {0.20F, 0.26F, 0.33F, 0.90F};
  style.ScaleAllSizes(scale);
  ImGuiIO& io = ImGui::GetIO();
  io.IniFilename = nullptr;
  if (std::filesystem::exists(kFont)) {
    io.Fonts->AddFontFromFileTTF(kFont, std::round(kFontPixels * scale));
  } else {
    io.FontGlobalScale = scale;
  }
}

bool is_software(const std::string& driver) {
  return driver.find("llvmpipe") != std::string::npos || driver.find("softpipe") != std::string::npos;
}

bool is_down(GLFWwindow* window, int key) {
  return glfwGetKey(window, key) == GLFW_PRESS;
}

/// Paces the frames: at most one each period.
class FramePacer {
 public:
  void set_period(Duration period) { period_ = period; }
  /// Waits until the next frame is due.
  void wait(LocalTime now) {
    if (next_ > now) std::this_thread::sleep_for(next_ - now);
    next_ = std::max(next_, now - period_) + period_;
  }

 private:
  Duration period_ = kFramePeriod;
  LocalTime next_{};
};

/// Detects double clicks by event times instead of frames: at a low frame rate both clicks arrive in one frame.
class DoubleClick {
 public:
  /// Adds a click at a place in pixels.
  void add(LocalTime now, const Eigen::Vector2d& at) {
    const bool is_second = now - clicked_at_ < kDoubleClick && (at - clicked_).norm() < kDoubleClickPixels;
    is_complete_ = is_complete_ || is_second;
    clicked_at_ = is_second ? LocalTime{} : now;
    clicked_ = at;
  }
  /// True if one was completed since the last call.
  bool pop() { return std::exchange(is_complete_, false); }

 private:
  bool is_complete_ = false;
  LocalTime clicked_at_{};  ///< time and place of the last click
  Eigen::Vector2d clicked_ = Eigen::Vector2d::Zero();
};

}  // namespace

struct Window::Impl {
  explicit Impl(WindowSettings window_settings);
  ~Impl();

  static void note_key(GLFWwindow* window, int key, int, int action, int modifiers);
  static void note_button(GLFWwindow* window, int button, int action, int modifiers);
  void fit() { camera.fit(scene->scene().focus_W, scene->scene().focus_radius_m); }
  double aspect() const { return static_cast<double>(width) / std::max(1, height); }
  void handle_keys();
  void handle_mouse();
  void handle_cap();
  void handle_hand_keys(double period_s);
  void move_hand_by_mouse(double right, double down, double wheel);
  void follow(const View* view);
  void point(const View* view);
  void draw_labels(const Mat4f& clip) const;
  void draw_hint() const;
  bool is_mouse() const { return settings.pointer != nullptr; }

  WindowSettings settings;
  GLFWwindow* window;
  std::unique_ptr<Renderer> renderer;
  std::unique_ptr<SceneView> scene;
  Camera camera;
  PointerHand hand;
  Figures figures;
  WindowSwitches switches;
  SteadyClock clock;
  FramePacer pacer;
  std::uint32_t hand_of = 0;  ///< scene generation of the hand's target
  int width = 0;              ///< size of the last frame's buffer
  int height = 0;
  std::filesystem::path picture;  ///< file for the next frame; empty: none
  std::vector<int> keys_pressed;  ///< since the last frame, including keys pressed and released in between
  DoubleClick double_click;
  bool is_holding = false;
  bool is_pointing_requested = false;
  bool is_recording = false;
  std::string recording_state;
  std::string news;
  bool is_record_pressed = false;
  bool has_turned = false;  ///< the user has moved the camera
};

Window::Impl::Impl(WindowSettings window_settings)
    : settings(std::move(window_settings)), window(open_window(settings)) {
  float scale = 1, scale_y = 1;
  glfwGetWindowContentScale(window, &scale, &scale_y);
  glfwSetWindowUserPointer(window, this);
  // These must be set before ImGui installs its callbacks, because ImGui's callbacks call them.
  glfwSetKeyCallback(window, note_key);
  glfwSetMouseButtonCallback(window, note_button);
  ImGui::CreateContext();
  set_style(std::clamp(scale, 0.5F, 4.0F));
  ImGui_ImplGlfw_InitForOpenGL(window, true);
  ImGui_ImplOpenGL3_Init("#version 330 core");
  if (settings.remembers) switches = remembered_switches(window_memory_file());
  apply_named(settings.molecules, MoleculeStyle::kShapeNames, switches.molecules.shape);
  apply_named(settings.molecule_colors, MoleculeStyle::kColorNames, switches.molecules.colors);
  renderer = std::make_unique<Renderer>();
  scene = std::make_unique<SceneView>(*renderer);
  if (is_software(Renderer::driver())) pacer.set_period(kSoftwareFramePeriod);
}

Window::Impl::~Impl() {
  if (settings.remembers) remember_switches(window_memory_file(), switches);
  scene.reset();
  renderer.reset();
  ImGui_ImplOpenGL3_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
  glfwDestroyWindow(window);
  glfwTerminate();
}

void Window::Impl::note_key(GLFWwindow* window, int key, int, int action, int modifiers) {
  auto& self = *static_cast<Impl*>(glfwGetWindowUserPointer(window));
  constexpr std::size_t kMaxKeys = 32;
  if (key == GLFW_KEY_Q && (modifiers & GLFW_MOD_CONTROL) != 0) glfwSetWindowShouldClose(window, GLFW_TRUE);
  if (action == GLFW_PRESS && self.keys_pressed.size() < kMaxKeys) self.keys_pressed.push_back(key);
}

void Window::Impl::note_button(GLFWwindow* window, int button, int action, int) {
  auto& self = *static_cast<Impl*>(glfwGetWindowUserPointer(window));
  if (button != GLFW_MOUSE_BUTTON_LEFT || action != GLFW_PRESS) return;
  Eigen::Vector2d at;
  glfwGetCursorPos(window, &at.x(), &at.y());
  self.double_click.add(self.clock.now(), at);
}

/// Returns the number of the next enumerator; the first one follows the last.
template <std::size_t kCount, class Number>
Number next_of(const std::array<const char*, kCount>&, Number number) {
  return static_cast<Number>((number + 1) % kCount);
}

void Window::Impl::handle_keys() {
  const std::vector<int> keys = std::exchange(keys_pressed, {});
  if (ImGui::GetIO().WantTextInput) return;  // a text field gets the keyboard input
  const auto pressed = [&keys](int key) { return std::ranges::find(keys, key) != keys.end(); };
  if (pressed(GLFW_KEY_F1)) switches.shows_help = !switches.shows_help;
  if (pressed(GLFW_KEY_TAB)) switches.shows_panels = !switches.shows_panels;
  if (pressed(GLFW_KEY_G)) switches.shows_ghosts = !switches.shows_ghosts;
  if (pressed(GLFW_KEY_T)) switches.follows_tool = !switches.follows_tool;
  if (pressed(GLFW_KEY_P)) switches.shows_contacts = !switches.shows_contacts;
  if (pressed(GLFW_KEY_X)) switches.cuts = !switches.cuts;
  MoleculeStyle& style = switches.molecules;
  if (pressed(GLFW_KEY_M)) style.shape = next_of(MoleculeStyle::kShapeNames, style.shape);
  if (pressed(GLFW_KEY_N)) style.colors = next_of(MoleculeStyle::kColorNames, style.colors);
  if (pressed(GLFW_KEY_F)) fit();
  if (pressed(GLFW_KEY_V)) is_pointing_requested = true;
  if (pressed(GLFW_KEY_1)) set_game_gravity(settings.client, true);
  if (pressed(GLFW_KEY_2)) set_game_gravity(settings.client, false);
  if (figures.has_molecules) {
    if (pressed(GLFW_KEY_K)) keep_pose(settings.client, switches);
    if (pressed(GLFW_KEY_Z)) ask_pose(settings.client, wire::AskPose::UNDO);
    if (pressed(GLFW_KEY_Y)) ask_pose(settings.client, wire::AskPose::REDO);
  }
  if (!is_mouse()) return;
  hand.follow_grab(is_holding, clock.now());
  if (pressed(GLFW_KEY_SPACE)) hand.toggle_grab(is_holding, clock.now());
  hand.press(kButtonClutch, is_down(window, GLFW_KEY_C));
  if (pressed(GLFW_KEY_R)) hand.rest();
  handle_hand_keys(ImGui::GetIO().DeltaTime);
}

void Window::Impl::handle_hand_keys(double period_s) {
  const auto way = [this](int more, int less) { return is_down(window, more) - is_down(window, less); };
  const double step = kKeyShare_per_s * std::min(period_s, 0.1);
  hand.move(camera, step * way(GLFW_KEY_RIGHT, GLFW_KEY_LEFT), step * way(GLFW_KEY_DOWN, GLFW_KEY_UP));
  hand.move_level(camera, 0, step * way(GLFW_KEY_PAGE_DOWN, GLFW_KEY_PAGE_UP));
}

void Window::Impl::handle_mouse() {
  const ImGuiIO& io = ImGui::GetIO();
  const bool is_double_click = double_click.pop();
  if (io.WantCaptureMouse || io.DisplaySize.y <= 0) return;
  if (is_mouse() && is_double_click) hand.toggle_grab(is_holding, clock.now());
  const double right = io.MouseDelta.x / io.DisplaySize.y, down = io.MouseDelta.y / io.DisplaySize.y;
  has_turned = has_turned || io.MouseDown[1] || io.MouseDown[2] || io.MouseWheel != 0;
  if (io.MouseDown[1]) camera.orbit(right, down);
  if (io.MouseDown[2]) camera.pan(right, down);
  if (is_mouse() && io.MouseDown[0]) {
    move_hand_by_mouse(right, down, io.MouseWheel);
  } else if (io.MouseDown[0]) {
    camera.orbit(right, down);
  } else {
    camera.zoom(io.MouseWheel);
  }
}

/// Moves the camera by the 3D mouse. Its device was opened so that the cap's pose is its control (devices/spacemouse).
void Window::Impl::handle_cap() {
  if (settings.cap == nullptr) return;
  const devices::DeviceSample sample = settings.cap->read(clock.now());
  if (!sample.is_valid) return;
  const Vec3 way = sample.X_DH.p / kCapReach_m, turn = rotation_vector(sample.X_DH.q) / kCapReach_rad;
  has_turned = has_turned || way.norm() + turn.norm() > 0.05;
  camera.steer(way, turn, ImGui::GetIO().DeltaTime);
}

void Window::Impl::move_hand_by_mouse(double right, double down, double wheel) {
  const ImGuiIO& io = ImGui::GetIO();
  if (io.KeyCtrl) {
    hand.turn(camera, kHandTurn_rad * right, kHandTurn_rad * down, kWheelTurn_rad * wheel);
  } else if (io.KeyShift) {
    hand.move_level(camera, right, down);
  } else {
    hand.move(camera, right, down);
    hand.move_level(camera, 0, -kWheelShare * wheel);
  }
}

/// Updates the hand's target and the camera from the device and the tool in the newest view.
void Window::Impl::follow(const View* view) {
  if (view == nullptr) return;
  hand.set_workspace(view->workspace);
  is_holding = view->record.held_body.is_valid();
  if (hand_of != view->record.scene_generation) hand.press(kButtonGrab, false);
  hand_of = view->record.scene_generation;
  if (view->record.sample.is_valid) hand.stay_near(view->record.sample.X_DH);
  if (switches.follows_tool) camera.focus_on(scene->tool_pose().p);
}

/// Points at the object under the mouse; if there is none, at the user's tool.
void Window::Impl::point(const View* view) {
  if (!std::exchange(is_pointing_requested, false) || settings.client == nullptr) return;
  const ImGuiIO& io = ImGui::GetIO();
  const auto [from_W, along_W] = camera.ray_at(io.MousePos.x / std::max(1.0F, io.DisplaySize.x),
                                               io.MousePos.y / std::max(1.0F, io.DisplaySize.y), aspect());
  std::vector<Pose> X_WB;
  for (std::size_t i = 0; i < scene->scene().bodies.size(); ++i) X_WB.push_back(felt_pose(scene->scene(), view, i));
  const auto hit = io.WantCaptureMouse ? std::nullopt : first_hit(scene->scene(), X_WB, from_W, along_W);
  wire::Point place;
  const Vec3 at = hit ? hit->second : scene->tool_pose().p;
  const Vec3 at_W = hit ? X_WB[hit->first] * at : at;
  if (hit) place.set_body(static_cast<std::uint32_t>(hit->first) + 1);
  for (const double number : at) place.add_place(number);
  for (const double number : at_W) place.add_place_w(number);
  settings.client->send(command::Point{place});
}

void Window::Impl::draw_labels(const Mat4f& clip) const {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  for (const SceneLabel& label : scene->labels()) {
    const Eigen::Vector4f at = clip * label.at_W.cast<float>().homogeneous();
    if (at.w() <= 0) continue;
    const ImVec2 middle((0.5F + 0.5F * at.x() / at.w()) * size.x, (0.5F - 0.5F * at.y() / at.w()) * size.y);
    const ImVec2 extent = ImGui::CalcTextSize(label.text.c_str());
    const ImVec2 from(middle.x - extent.x / 2, middle.y - extent.y * static_cast<float>(0.5 + label.above));
    const float rim = 0.25F * ImGui::GetFontSize();
    list.AddRectFilled(ImVec2(from.x - rim, from.y - rim / 2),
                       ImVec2(from.x + extent.x + rim, from.y + extent.y + rim / 2), IM_COL32(18, 22, 26, 190), rim);
    list.AddText(from, ImGui::ColorConvertFloat4ToU32({label.color[0], label.color[1], label.color[2], 1}),
                 label.text.c_str());
  }
}

void Window::Impl::draw_hint() const {
  const char* hint = "drag with the right button: look around    F1: help";
  if (is_mouse()) {
    hint = "drag: move the hand    Shift: away, towards    double click: grab    right button: look around    F1: help";
    if (is_holding) hint = "drag: move the hand    double click: release    drag with Ctrl: turn it    F1: help";
  }
  if (hand.has_missed(clock.now())) hint = "nothing within reach to grab: move the hand nearer";
  const float em = ImGui::GetFontSize();
  ImGui::GetBackgroundDrawList()->AddText(ImVec2(em, ImGui::GetIO().DisplaySize.y - 2 * em),
                                          IM_COL32(235, 240, 245, 210), hint);
}

Window::Window(WindowSettings settings) : impl_(std::make_unique<Impl>(std::move(settings))) {}

Window::~Window() = default;

void Window::add(const TickRecord& record) {
  impl_->figures.add(record);
}

void Window::draw(const View* view, const ClientIoSnapshot& io, const std::string& notice) {
  Impl& self = *impl_;
  self.pacer.wait(self.clock.now());
  glfwPollEvents();
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
  self.figures.add(view, io, self.clock.now());
  if (self.scene->update(io, self.switches.molecules) && !self.has_turned) self.fit();
  self.handle_keys();
  self.handle_mouse();
  self.handle_cap();
  self.follow(view);
  self.point(view);
  if (self.is_mouse()) self.settings.pointer->publish(self.hand.target());
  self.figures.add_molecules(self.scene->scene(), view, io, self.clock.now());
  self.scene->arrange(view, io, self.switches, self.camera, self.figures, self.clock.now());

  glfwGetFramebufferSize(self.window, &self.width, &self.height);
  self.camera.leave_free(self.switches.shows_panels ? panels_width() / ImGui::GetIO().DisplaySize.x : 0);
  self.renderer->draw(self.scene->frame(), self.camera, self.width, self.height);
  self.draw_hint();
  self.draw_labels(self.camera.projection_of_world(self.aspect()));
  const std::string problem = session_problem(io);
  const PanelContent content{.client = self.settings.client,
                             .view = view,
                             .io = &io,
                             .figures = &self.figures,
                             .facts = &self.settings.facts,
                             .missing = &self.scene->scene().missing,
                             .notice = problem.empty() ? notice : problem,
                             .news = self.news,
                             .is_mouse = self.is_mouse(),
                             .camera_turn_rad = self.camera.turn_rad(),
                             .is_making_molecules = self.scene->is_making(self.switches.molecules),
                             .is_recording = self.is_recording,
                             .recording_state = &self.recording_state,
                             .recording_folder = &self.settings.recording_folder,
                             .is_record_pressed = &self.is_record_pressed};
  draw_panels(content, self.switches, self.settings.link, self.settings.workspace);
  ImGui::Render();
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  if (!self.picture.empty()) {
    const std::filesystem::path file = std::exchange(self.picture, {});
    write_png(file, Renderer::pixels(self.width, self.height), self.width, self.height);
  }
  glfwSwapBuffers(self.window);
}

void Window::show_recording(bool is_recording, const std::string& state) {
  impl_->is_recording = is_recording;
  impl_->recording_state = state;
}

void Window::show_news(const std::string& news) {
  impl_->news = news;
}

bool Window::pop_record_press() {
  return std::exchange(impl_->is_record_pressed, false);
}

bool Window::is_closed() const {
  return glfwWindowShouldClose(impl_->window) != GLFW_FALSE;
}

bool Window::is_making() const {
  return impl_->scene->is_making(impl_->switches.molecules);
}

void Window::save_next_frame(const std::filesystem::path& file) {
  impl_->picture = file;
}

}  // namespace tandem::client
