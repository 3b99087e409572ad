// See window.hpp.
#include "client/view/window.hpp"

#include <epoxy/gl.h>
// This header must follow the header of the OpenGL functions, which it would otherwise declare itself.
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <fstream>
#include <optional>

#include "client/session/scene_from_wire.hpp"
#include "client/view/goal_panel.hpp"
#include "client/view/guide/guide_card.hpp"
#include "client/view/panels.hpp"
#include "client/view/pointer_hand.hpp"
#include "client/view/scene_view.hpp"
#include "client/view/screen/menu.hpp"
#include "client/view/screen/screen.hpp"
#include "client/view/screen/sentences.hpp"
#include "client/view/sound/alsa_sink.hpp"
#include "client/view/sound/window_sounds.hpp"
#include "client/view/window_memory.hpp"

namespace tandem::client {
namespace {

/// Motion of the hand as a fraction of the window's height: for a step of the mouse wheel, and for a pressed arrow key
/// per second.
constexpr double kWheelShare = 0.02;
constexpr double kKeyShare_per_s = 0.25;
/// Rotation of the hand for a mouse motion across the window's height.
constexpr double kHandTurn_rad = 3;
constexpr double kWheelTurn_rad = 0.08;
/// Time for which a message about the room is shown.
constexpr Duration kNewsShown = std::chrono::seconds(15);
/// Ratio of width to height of the area beside the panel. Below this ratio, the scene is drawn smaller.
constexpr double kNarrowAspect = 0.8;
/// Message after a grab that found no body.
constexpr const char* kMissed = "nothing within reach to grab: move the hand nearer";
/// Translation and rotation of a 3D mouse's cap that count as full deflection.
constexpr double kCapReach_m = 0.04, kCapReach_rad = 0.5;

bool is_down(GLFWwindow* window, int key) {
  return glfwGetKey(window, key) == GLFW_PRESS;
}

}  // namespace

struct Window::Impl {
  explicit Impl(WindowSettings window_settings);
  ~Impl();

  void fit();
  double aspect() const { return static_cast<double>(screen.width()) / std::max(1, screen.height()); }
  void handle_keys();
  template <class Pressed>
  void handle_shared_keys(const Pressed& pressed);
  void handle_hand(bool toggles_grab, bool rests);
  void handle_menu();
  void save_picture();
  void draw_messages(const ClientIoSnapshot& io, float bottom) const;
  bool handle_mouse();
  void handle_escape();
  void handle_cap();
  void handle_hand_keys(double period_s);
  void move_hand_by_mouse(double right, double down, double wheel);
  void follow(const View* view);
  void point(const View* view);
  std::vector<Pose> body_poses(const View* view) const;
  std::pair<Vec3, Vec3> mouse_ray() const;
  void follow_molecules(const View* view, const ClientIoSnapshot& io, bool is_double_click);
  void draw_labels(const Mat4f& clip) const;
  void draw_lower_left(const ClientIoSnapshot& io);
  float draw_hint(const ClientIoSnapshot& io) const;
  void follow_guide(const View* view, const ClientIoSnapshot& io);
  bool shows_guide(const ClientIoSnapshot& io) const { return guide.is_on() && io.joined != nullptr; }
  void draw_guide_card(const ClientIoSnapshot& io);
  void remember();
  float free_width() const;
  bool is_mouse() const { return settings.pointer != nullptr; }

  WindowSettings settings;
  Screen& screen;
  GLFWwindow* window;
  std::unique_ptr<Renderer> renderer;
  std::unique_ptr<SceneView> scene;
  Camera camera;
  PointerHand hand;
  Figures figures;
  Guide guide;
  MoleculeMouse molecules;
  std::optional<WindowSounds> sounds;  ///< empty if the user has a haptic device, with which contact is felt
  WindowSwitches switches;
  SteadyClock clock;
  std::uint32_t hand_of = 0;  ///< generation of the scene for which the hand's target was set
  bool is_holding = false;
  bool is_pointing_requested = false;
  bool is_recording = false;
  std::string recording_state;
  std::string news;
  LocalTime news_at{};
  bool is_record_pressed = false;
  WindowRequest request = WindowRequest::kNone;
  MenuState menu;
  std::string picture_news;  ///< message about the last saved picture
  bool has_turned = false;   ///< true: the user has moved the camera
};

Window::Impl::Impl(WindowSettings window_settings)
    : settings(std::move(window_settings)), screen(*settings.screen), window(screen.handle()) {
  screen.set_title(settings.title);
  if (settings.remembers) switches = remembered_switches(window_memory_file());
  apply_named(settings.molecules, MoleculeStyle::kShapeNames, switches.molecules.shape);
  apply_named(settings.molecule_colors, MoleculeStyle::kColorNames, switches.molecules.colors);
  guide = Guide(switches.guide);
  if (is_mouse() && settings.remembers) sounds.emplace(alsa_sink());
  if (settings.begins_guide) guide.resume();
  renderer = std::make_unique<Renderer>(screen.quality());
  scene = std::make_unique<SceneView>(*renderer);
}

Window::Impl::~Impl() {
  remember();
  scene.reset();
  renderer.reset();
}

void Window::Impl::remember() {
  switches.guide = guide.progress();
  if (settings.remembers) remember_switches(window_memory_file(), switches);
}

/// Returns the number of the next enumerator; the first one follows the last.
template <std::size_t kCount, class Number>
Number next_of(const std::array<const char*, kCount>&, Number number) {
  return static_cast<Number>((number + 1) % kCount);
}

void Window::Impl::handle_keys() {
  const std::vector<int> keys = screen.take_keys();
  if (ImGui::GetIO().WantTextInput) return;  // the keyboard input belongs to a text field
  const auto pressed = [&keys](int key) { return std::ranges::find(keys, key) != keys.end(); };
  if (pressed(GLFW_KEY_F11)) screen.toggle_full_screen();
  if (pressed(GLFW_KEY_ESCAPE)) handle_escape();
  if (pressed(GLFW_KEY_F1)) switches.shows_help = !switches.shows_help;
  if (pressed(GLFW_KEY_TAB)) switches.shows_panels = !switches.shows_panels;
  handle_hand(pressed(GLFW_KEY_SPACE), pressed(GLFW_KEY_R));
  if (ImGui::GetIO().KeyCtrl) return handle_shared_keys(pressed);
  if (pressed(GLFW_KEY_G)) switches.shows_ghosts = !switches.shows_ghosts;
  if (pressed(GLFW_KEY_T)) switches.follows_tool = !switches.follows_tool;
  if (pressed(GLFW_KEY_P)) switches.shows_contacts = !switches.shows_contacts;
  if (pressed(GLFW_KEY_X)) switches.cuts = !switches.cuts;
  MoleculeStyle& style = switches.molecules;
  if (pressed(GLFW_KEY_M)) style.shape = next_of(MoleculeStyle::kShapeNames, style.shape);
  if (pressed(GLFW_KEY_N)) style.colors = next_of(MoleculeStyle::kColorNames, style.colors);
  if (pressed(GLFW_KEY_S)) switches.has_sound = !switches.has_sound;
  if (pressed(GLFW_KEY_F)) fit();
  if (pressed(GLFW_KEY_V)) is_pointing_requested = true;
  if (pressed(GLFW_KEY_1)) set_game_gravity(settings.client, true);
  if (pressed(GLFW_KEY_2)) set_game_gravity(settings.client, false);
}

/// Closes help and dialogs. Without any of them, removes the selection of residues.
void Window::Impl::handle_escape() {
  const bool shows_invitations = menu.shows_invitations && !settings.invitations.empty();
  if (!switches.shows_help && !shows_invitations) molecules.clear();
  switches.shows_help = menu.shows_invitations = false;
}

/// Handles the keys that change the scene for all users. These keys require Ctrl, so that a key pressed by mistake has
/// no effect on other users.
template <class Pressed>
void Window::Impl::handle_shared_keys(const Pressed& pressed) {
  if (!figures.has_molecules) return;
  if (pressed(GLFW_KEY_K)) keep_pose(settings.client, switches);
  if (pressed(GLFW_KEY_Z)) ask_pose(settings.client, wire::AskPose::UNDO);
  if (pressed(GLFW_KEY_Y)) ask_pose(settings.client, wire::AskPose::REDO);
}

/// Moves the hand of the device "mouse" by keys.
void Window::Impl::handle_hand(bool toggles_grab, bool rests) {
  if (!is_mouse()) return;
  hand.follow_grab(is_holding, clock.now());
  if (toggles_grab) hand.toggle_grab(is_holding, clock.now());
  hand.press(kButtonClutch, is_down(window, GLFW_KEY_C));
  if (rests) hand.rest();
  handle_hand_keys(ImGui::GetIO().DeltaTime);
}

void Window::Impl::handle_hand_keys(double period_s) {
  const auto way = [this](int more, int less) { return is_down(window, more) - is_down(window, less); };
  const double step = kKeyShare_per_s * std::min(period_s, 0.1);
  hand.move(camera, step * way(GLFW_KEY_RIGHT, GLFW_KEY_LEFT), step * way(GLFW_KEY_DOWN, GLFW_KEY_UP));
  hand.move_level(camera, 0, step * way(GLFW_KEY_PAGE_DOWN, GLFW_KEY_PAGE_UP));
}

/// Returns whether a double click was completed.
bool Window::Impl::handle_mouse() {
  const ImGuiIO& io = ImGui::GetIO();
  const bool is_double_click = screen.pop_double_click();
  if (io.WantCaptureMouse || io.DisplaySize.y <= 0) return is_double_click;
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
  return is_double_click;
}

/// Moves the camera by the 3D mouse, whose device reports the deflection of the cap as a pose (devices/spacemouse).
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

std::vector<Pose> Window::Impl::body_poses(const View* view) const {
  std::vector<Pose> X_WB;
  for (std::size_t i = 0; i < scene->scene().bodies.size(); ++i) X_WB.push_back(felt_pose(scene->scene(), view, i));
  return X_WB;
}

/// Returns origin and direction of the line of sight through the mouse.
std::pair<Vec3, Vec3> Window::Impl::mouse_ray() const {
  const ImGuiIO& io = ImGui::GetIO();
  return camera.ray_at(io.MousePos.x / std::max(1.0F, io.DisplaySize.x),
                       io.MousePos.y / std::max(1.0F, io.DisplaySize.y), aspect());
}

/// Finds the atom under the mouse. A click (a press of the left button without a drag) selects the atom.
void Window::Impl::follow_molecules(const View* view, const ClientIoSnapshot& io, bool is_double_click) {
  molecules.belong_to(io.joined);
  if (!figures.has_molecules) return;
  const ImGuiIO& input = ImGui::GetIO();
  const std::vector<Pose> X_WB = body_poses(view);
  const auto [from_W, along_W] = mouse_ray();
  const bool is_short = input.MouseDragMaxDistanceSqr[0] < input.MouseDragThreshold * input.MouseDragThreshold;
  molecules.follow({.scene = scene->scene(),
                    .X_WB = X_WB,
                    .metres_per_angstrom = io.joined->scene().molecular_field().metres_per_angstrom(),
                    .from_W = from_W,
                    .along_W = along_W,
                    .is_free = !input.WantCaptureMouse && !ImGui::IsAnyMouseDown(),
                    .is_click = !input.WantCaptureMouse && input.MouseReleased[0] && is_short,
                    .is_double_click = is_double_click,
                    .now = clock.now(),
                    .cut_W = scene->frame().cut_W});
  scene->add_selection(view, molecules.selection(), molecules.distance());
}

/// Points, for the other users, at the object under the mouse. If there is no object, points at the user's tool.
void Window::Impl::point(const View* view) {
  if (!std::exchange(is_pointing_requested, false) || settings.client == nullptr) return;
  const auto [from_W, along_W] = mouse_ray();
  const std::vector<Pose> X_WB = body_poses(view);
  const auto hit = ImGui::GetIO().WantCaptureMouse ? std::nullopt : first_hit(scene->scene(), X_WB, from_W, along_W);
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

/// Draws the card of the guide; if it is not shown, draws a hint. Messages are drawn above it.
void Window::Impl::draw_lower_left(const ClientIoSnapshot& io) {
  const float em = ImGui::GetFontSize();
  if (!shows_guide(io)) return draw_messages(io, draw_hint(io) - 0.6F * em);
  draw_messages(io, guide_place(free_width()).y - 0.6F * em);
  draw_guide_card(io);
}

/// Draws a line about the use of mouse and keys. Returns its upper edge [px].
float Window::Impl::draw_hint(const ClientIoSnapshot& io) const {
  const char* hint = "drag with the right button: look around    F1: help";
  if (is_mouse() && io.joined && has_tool(io.joined->role())) {
    hint = "drag: move the hand    Shift: away, towards    double click: grab    right button: look around    F1: help";
    if (is_holding) hint = "drag: move the hand    double click: release    drag with Ctrl: turn it    F1: help";
  }
  if (hand.has_missed(clock.now())) hint = kMissed;
  const float em = ImGui::GetFontSize(), width = free_width() - 2 * em;
  const ImVec2 extent = ImGui::CalcTextSize(hint, nullptr, false, width);
  const float top = ImGui::GetIO().DisplaySize.y - extent.y - 0.8F * em;
  ImGui::GetBackgroundDrawList()->AddText(nullptr, 0, ImVec2(em, top), IM_COL32(235, 240, 245, 210), hint, nullptr,
                                          width);
  return top;
}

/// Passes the state of this frame to the guide. The progress is stored as soon as a step is done, so that it is not
/// lost in a crash.
void Window::Impl::follow_guide(const View* view, const ClientIoSnapshot& io) {
  if (view == nullptr || io.joined == nullptr || io.joined->scene().name() != kGuideScene) return;
  guide.follow({.force_n = view->record.displayed_on_hand_D.f.norm(),
                .is_holding = is_holding,
                .p_WT = scene->tool_pose().p,
                .added_delay = settings.link.delay,
                .stage = io.rendering.stage.name},
               clock.now());
  if (guide.progress() != switches.guide) remember();
}

void Window::Impl::draw_guide_card(const ClientIoSnapshot& io) {
  const GuideCard card{
      .step = guide.progress().step, .is_mouse = is_mouse(), .is_in_scene = io.joined->scene().name() == kGuideScene};
  switch (draw_guide(card, free_width())) {
    case GuideAction::kNone:
      break;
    case GuideAction::kSkip:
      guide.skip();
      break;
    case GuideAction::kEnd:
      guide.end();
      break;
    case GuideAction::kOpenScene:
      request = WindowRequest::kGuide;
      break;
  }
}

/// Draws the last messages (about the room, the stage, the recording) above the hint. In this place they move no
/// control.
void Window::Impl::draw_messages(const ClientIoSnapshot& io, float bottom) const {
  const float em = ImGui::GetFontSize(), width = free_width() - 2 * em, rim = 0.25F * em;
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  // Shown only together with the guide's card. Without the card, the hint contains this message.
  const std::string missed = shows_guide(io) && hand.has_missed(clock.now()) ? kMissed : "";
  for (const std::string* text : {&missed, &news, &io.rendering.stage_note, &recording_state, &picture_news}) {
    const bool is_old = text == &news && clock.now() - news_at > kNewsShown;
    if (text->empty() || is_old) continue;
    const ImVec2 extent = ImGui::CalcTextSize(text->c_str(), nullptr, false, width);
    bottom -= extent.y;
    list.AddRectFilled(ImVec2(em - rim, bottom - rim), ImVec2(em + extent.x + rim, bottom + extent.y + rim),
                       IM_COL32(18, 22, 26, 190), rim);
    list.AddText(nullptr, 0, ImVec2(em, bottom), IM_COL32(200, 210, 220, 255), text->c_str(), nullptr, width);
    bottom -= 3 * rim;
  }
}

/// Width of the window beside the panel.
float Window::Impl::free_width() const {
  const bool has_panel = switches.shows_panels && !settings.is_scene_only;
  return ImGui::GetIO().DisplaySize.x - (has_panel ? static_cast<float>(panels_width()) : 0);
}

/// Moves the camera such that the whole scene is visible. In a narrow window the scene is drawn smaller, so that the
/// panel does not cover its sides.
void Window::Impl::fit() {
  const double free_aspect = free_width() / std::max(1.0F, ImGui::GetIO().DisplaySize.y);
  camera.fit(scene->scene().focus_W, scene->scene().focus_radius_m / std::min(1.0, free_aspect / kNarrowAspect));
}

void Window::Impl::handle_menu() {
  const MenuContent content{
      .is_recording = is_recording, .shows_panels = switches.shows_panels, .invitations = &settings.invitations};
  switch (draw_menu(content, menu)) {
    case MenuAction::kNone:
      break;
    case MenuAction::kOpen:
      request = WindowRequest::kOpen;
      break;
    case MenuAction::kHost:
      request = WindowRequest::kHost;
      break;
    case MenuAction::kSavePicture:
      save_picture();
      break;
    case MenuAction::kRecord:
      is_record_pressed = true;
      break;
    case MenuAction::kFullScreen:
      screen.toggle_full_screen();
      break;
    case MenuAction::kSettings:
      switches.shows_panels = switches.is_open[7] = true;
      break;
    case MenuAction::kGuide:
      guide.begin();
      break;
    case MenuAction::kHelp:
      switches.shows_help = true;
      break;
    case MenuAction::kPanels:
      switches.shows_panels = !switches.shows_panels;
      break;
    case MenuAction::kQuit:
      screen.close();
      break;
  }
}

/// Writes the scene of the next frame, without panels and texts, into a new file beside the recordings.
void Window::Impl::save_picture() {
  std::array<char, 40> name{};
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::strftime(name.data(), name.size(), "tandem-%Y%m%dT%H%M%SZ.png", &utc);
  const std::filesystem::path file = std::filesystem::path(settings.recording_folder) / name.data();
  // An error of the file is shown as a message, because it must not end the session.
  if (!std::ofstream(file)) {
    picture_news = "the picture " + file.string() + " cannot be written";
    return;
  }
  screen.save_next_frame(file, true);
  picture_news = "picture: " + file.string();
}

Window::Window(WindowSettings settings) : impl_(std::make_unique<Impl>(std::move(settings))) {}

Window::~Window() = default;

void Window::add(const TickRecord& record) {
  impl_->figures.add(record);
  if (impl_->sounds) impl_->sounds->add(record);
}

void Window::draw(const View* view, const ClientIoSnapshot& io, const std::string& notice) {
  Impl& self = *impl_;
  self.screen.begin_frame();
  self.figures.add(view, io, self.clock.now());
  if (self.scene->update(io, self.switches.molecules) && !self.has_turned) self.fit();
  self.handle_keys();
  const bool is_double_click = self.handle_mouse();
  self.handle_cap();
  self.follow(view);
  self.point(view);
  if (self.is_mouse()) self.settings.pointer->publish(self.hand.target());
  self.figures.add_molecules(self.scene->scene(), view, io, self.clock.now());
  self.scene->arrange(view, io, self.switches, self.camera, self.figures, self.clock.now());
  self.follow_molecules(view, io, is_double_click);

  self.camera.leave_free(1 - self.free_width() / ImGui::GetIO().DisplaySize.x);
  self.renderer->draw(self.scene->frame(), self.camera, self.screen.width(), self.screen.height());
  self.follow_guide(view, io);
  if (self.sounds) self.sounds->follow(view, io, self.switches.has_sound, self.clock.now());
  self.draw_lower_left(io);
  self.draw_labels(self.camera.projection_of_world(self.aspect()));
  self.handle_menu();
  std::string problem = session_problem(io);
  if (problem.empty() && notice.empty()) problem = force_problem(view, io);
  const PanelContent content{.client = self.settings.client,
                             .view = view,
                             .io = &io,
                             .figures = &self.figures,
                             .facts = &self.settings.facts,
                             .missing = &self.scene->scene().missing,
                             .notice = problem.empty() ? notice : problem,
                             .is_mouse = self.is_mouse(),
                             .camera_turn_rad = self.camera.turn_rad(),
                             .is_making_molecules = self.scene->is_making(self.switches.molecules),
                             .is_recording = self.is_recording,
                             .recording_state = &self.recording_state,
                             .recording_folder = &self.settings.recording_folder,
                             .is_record_pressed = &self.is_record_pressed,
                             .molecules = self.molecules.content(self.scene->scene())};
  draw_panels(content, self.switches, self.settings.link, self.settings.workspace);
  self.screen.end_frame();
}

void Window::show_recording(bool is_recording, const std::string& state) {
  impl_->is_recording = is_recording;
  impl_->recording_state = state;
}

void Window::show_news(const std::string& news) {
  impl_->news = news;
  impl_->news_at = impl_->clock.now();
}

bool Window::pop_record_press() {
  return std::exchange(impl_->is_record_pressed, false);
}

WindowRequest Window::pop_request() {
  return std::exchange(impl_->request, WindowRequest::kNone);
}

bool Window::is_closed() const {
  return impl_->screen.is_closed();
}

bool Window::is_making() const {
  return impl_->scene->is_making(impl_->switches.molecules);
}

void Window::save_next_frame(const std::filesystem::path& file) {
  impl_->screen.save_next_frame(file, impl_->settings.is_scene_only);
}

}  // namespace tandem::client
