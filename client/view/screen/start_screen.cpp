// See start_screen.hpp.
#include "client/view/screen/start_screen.hpp"

#include <epoxy/gl.h>
// This header must follow the header of the OpenGL functions, which it would otherwise declare itself.
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

#include "client/start/shipped_scenes.hpp"
#include "client/view/screen/scene_pictures.hpp"
#include "client/view/screen/style.hpp"
#include "client/view/window_memory.hpp"
#include "common/base/folders.hpp"

namespace tandem::client {
namespace {

constexpr float kCardEm = 13;   ///< minimum width of a card, in font heights
constexpr float kFormsEm = 25;  ///< width of the column of forms
constexpr float kTwoColumnsEm = 46;
constexpr float kPictureRatio = 0.56F;  ///< ratio of a picture's height to its width
constexpr int kSentenceLines = 3;

float em() {
  return ImGui::GetFontSize();
}

void begin_section(const char* text) {
  ImGui::Spacing();
  ImGui::TextColored(kTitle, "%s", text);
  ImGui::Separator();
}

template <std::size_t kSize>
void put(std::array<char, kSize>& field, const std::string& text) {
  field = {};
  text.copy(field.data(), kSize - 1);
}

/// Draws a field that fills the row beside a button. Returns whether the button or Enter was pressed.
template <std::size_t kSize>
bool field_with_button(const char* id, const char* hint, std::array<char, kSize>& field, const char* button) {
  const ImGuiStyle& style = ImGui::GetStyle();
  ImGui::SetNextItemWidth(-ImGui::CalcTextSize(button).x - 2 * style.FramePadding.x - style.ItemSpacing.x);
  const bool is_entered =
      ImGui::InputTextWithHint(id, hint, field.data(), field.size(), ImGuiInputTextFlags_EnterReturnsTrue);
  ImGui::SameLine();
  return ImGui::Button(button) || is_entered;
}

/// Draws a card that is one button. Returns whether it was pressed.
bool card(const ShippedScene& scene, std::uint32_t texture, float width) {
  const float rim = 0.5F * em(), picture = kPictureRatio * width;
  const float height = picture + rim + (1 + kSentenceLines) * ImGui::GetTextLineHeight() + 1.4F * rim;
  const ImVec2 from = ImGui::GetCursorScreenPos();
  ImGui::PushID(scene.name.data());
  const bool is_pressed = ImGui::InvisibleButton("card", ImVec2(width, height));
  const bool is_hot = ImGui::IsItemHovered() || ImGui::IsItemFocused();
  ImGui::PopID();
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const ImVec2 to(from.x + width, from.y + height);
  list.AddRectFilled(from, to, is_hot ? IM_COL32(52, 66, 84, 255) : IM_COL32(34, 40, 48, 255), 0.4F * em());
  const ImVec2 below(to.x, from.y + picture);
  if (texture != 0) {
    const auto id = reinterpret_cast<ImTextureID>(static_cast<std::uintptr_t>(texture));
    list.AddImageRounded(id, from, below, ImVec2(0, 0), ImVec2(1, 1), IM_COL32_WHITE, 0.4F * em(),
                         ImDrawFlags_RoundCornersTop);
  } else {
    list.AddRectFilled(from, below, IM_COL32(58, 70, 84, 255), 0.4F * em(), ImDrawFlags_RoundCornersTop);
  }
  if (is_hot) list.AddRect(from, to, IM_COL32(96, 160, 235, 255), 0.4F * em(), 0, 2);
  const ImVec2 title(from.x + rim, below.y + 0.6F * rim);
  list.AddText(title, ImGui::GetColorU32(kTitle), scene.title.data(), scene.title.data() + scene.title.size());
  const ImVec2 sentence(title.x, title.y + ImGui::GetTextLineHeight() + 0.3F * rim);
  list.AddText(nullptr, 0, sentence, ImGui::GetColorU32(kDim), scene.sentence.data(),
               scene.sentence.data() + scene.sentence.size(), width - 2 * rim);
  return is_pressed;
}

/// Returns a choice of the given kind with the values of the form, including whether the session is hosted.
StartChoice form_choice(StartFlow& flow, StartChoice::Kind kind) {
  StartChoice choice = flow.form();
  choice.kind = kind;
  return choice;
}

void draw_scenes(StartFlow& flow, ScenePictures* pictures) {
  begin_section("Scenes to try");
  const float space = ImGui::GetStyle().ItemSpacing.x, all = ImGui::GetContentRegionAvail().x;
  const int columns = std::max(1, static_cast<int>((all + space) / (kCardEm * em() + space)));
  const float width = std::floor((all - space * static_cast<float>(columns - 1)) / static_cast<float>(columns));
  int column = 0;
  for (const ShippedScene& scene : shipped_scenes()) {
    if (column > 0) ImGui::SameLine();
    if (card(scene, pictures == nullptr ? 0 : pictures->texture(scene.name), width)) {
      StartChoice choice = form_choice(flow, StartChoice::Kind::kScene);
      choice.scene = scene.name;
      flow.open(choice);
    }
    column = (column + 1) % columns;
  }
}

void draw_join(StartFlow& flow, StartForm& form) {
  begin_section("Join others");
  draw_explanation("Paste the invitation that the host sent to you.");
  if (field_with_button("##address", "invitation", form.address, "Join")) {
    StartChoice choice = form_choice(flow, StartChoice::Kind::kJoin);
    choice.address = form.address.data();
    flow.open(choice);
  }
}

void draw_hosting(StartFlow& flow) {
  begin_section("Host for others");
  StartChoice& choice = flow.form();
  ImGui::Checkbox("others may join what I open", &choice.is_hosted);
  if (!choice.is_hosted)
    return draw_explanation("Off: only you. On: you get one invitation for each person, to send by mail or chat.");
  ImGui::SetNextItemWidth(7 * em());
  ImGui::InputInt("people to invite", &choice.invited);
  choice.invited = std::clamp(choice.invited, 1, kMaxInvited);
  ImGui::SetNextItemWidth(7 * em());
  ImGui::InputInt("port, TCP and UDP", &choice.port, 0);
  choice.port = std::clamp(choice.port, 0, 65535);
  draw_explanation("The connection is encrypted. The port must be open on this machine. Now choose a scene or a file.");
}

void draw_mesh(StartFlow& flow, StartForm& form) {
  begin_section("Open a mesh");
  draw_explanation("Type a path, or drop the file onto this window.");
  StartChoice& choice = flow.form();
  auto size_cm = static_cast<float>(choice.mesh_size_m * 100);
  if (field_with_button("##mesh", "part.stl, .obj, .ply, .glb ...", form.file, "Open")) {
    StartChoice opened = form_choice(flow, StartChoice::Kind::kMesh);
    opened.mesh = form.file.data();
    flow.open(opened);
  }
  ImGui::SetNextItemWidth(8 * em());
  ImGui::InputFloat("longest edge [cm]", &size_cm, 1, 5, "%.0f");
  choice.mesh_size_m = std::clamp(size_cm / 100.0, kMinMeshSize_m, kMaxMeshSize_m);
  ImGui::Checkbox("y is up", &choice.is_y_up);
  ImGui::SameLine();
  ImGui::Checkbox("it can be lifted", &choice.is_movable);
}

void draw_docking(StartFlow& flow, StartForm& form) {
  begin_section("Dock two structure files");
  draw_explanation("A molecule for each hand: PDB, mmCIF, PQR or PDBQT. FILE:A is chain A of a file.");
  ImGui::SetNextItemWidth(-1);
  ImGui::InputTextWithHint("##receptor", "first file, e.g. 3al1.pdb:A", form.receptor.data(), form.receptor.size());
  if (field_with_button("##ligand", "second file, e.g. 3al1.pdb:B", form.ligand, "Dock")) {
    StartChoice choice = form_choice(flow, StartChoice::Kind::kDock);
    choice.receptor = form.receptor.data();
    choice.ligand = form.ligand.data();
    flow.open(choice);
  }
}

void draw_recent(StartFlow& flow) {
  if (flow.recent().empty()) return;
  begin_section("Recent");
  // A copy, because opening changes the list.
  const std::vector<StartChoice> recent = flow.recent();
  for (std::size_t i = 0; i < recent.size(); ++i) {
    const std::string label = title_of(recent[i]) + (recent[i].is_hosted ? ", hosted" : "");
    ImGui::PushID(static_cast<int>(i));
    if (ImGui::Button(label.c_str(), ImVec2(-1, 0))) flow.open(recent[i]);
    ImGui::PopID();
  }
}

void draw_forms(StartFlow& flow, StartForm& form) {
  begin_section("You");
  ImGui::SetNextItemWidth(-5 * em());
  ImGui::InputText("your name", form.name.data(), form.name.size());
  for (const std::string& line : form.devices) draw_explanation(line.c_str());
  draw_join(flow, form);
  draw_hosting(flow);
  draw_mesh(flow, form);
  draw_docking(flow, form);
  draw_recent(flow);
  ImGui::Spacing();
  draw_explanation(form.about.c_str());
}

/// Draws the reason why the last choice was not opened, below the title. The height of this area never changes.
void draw_problem(const std::string& problem, bool waits_for_guide) {
  const float height = 2 * ImGui::GetTextLineHeightWithSpacing();
  ImGui::BeginChild("problem", ImVec2(0, height));
  if (problem.empty() && waits_for_guide) {
    draw_explanation("The guided first minute opens as soon as its server, the program tandem-server, is built.");
  } else if (problem.empty()) {
    draw_explanation("Touch and move the same things, together. Choose a scene, open a file, or join others.");
  } else {
    ImGui::PushStyleColor(ImGuiCol_Text, kWarning);
    ImGui::TextWrapped("%s", problem.c_str());
    ImGui::PopStyleColor();
  }
  ImGui::EndChild();
}

/// Draws the button of the guide beside the title.
void draw_guide_button(StartForm& form) {
  std::string label = "Guided first minute";
  const auto done = static_cast<std::size_t>(form.guide.step);
  if (form.guide.is_on && done > 0 && done < kGuideTasks) {
    label = "Continue the guide at step " + std::to_string(done + 1) + " of " + std::to_string(kGuideTasks);
  }
  ImGui::SameLine(0, 1.5F * em());
  if (ImGui::Button((label + "###guide").c_str())) form.wants_guide = true;
}

/// Draws a part of the page in a region that scrolls separately.
template <class Draw>
void draw_in_child(const char* name, const Draw& draw, float width = 0) {
  // Without padding, the clip rectangle would cut letters that extend to the left of their origin, such as J.
  ImGui::BeginChild(name, ImVec2(width, 0), false, ImGuiWindowFlags_AlwaysUseWindowPadding);
  draw();
  ImGui::EndChild();
}

/// Draws the page that is shown while the server prepares.
void draw_waiting(StartFlow& flow) {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  ImGui::SetCursorPosY(0.35F * size.y);
  ImGui::TextColored(kTitle, "Preparing: %s", flow.title().c_str());
  draw_explanation(flow.progress().empty() ? "This takes a second or two, and longer for a large mesh."
                                           : flow.progress().c_str());
  ImGui::Spacing();
  if (ImGui::Button("Cancel") || ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape))) flow.cancel();
}

}  // namespace

void draw_start(StartFlow& flow, StartForm& form, ScenePictures* pictures) {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos(ImVec2(0, 0));
  ImGui::SetNextWindowSize(size);
  ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 0);
  ImGui::Begin("##start", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoBringToFrontOnFocus);
  ImGui::PopStyleVar();
  if (flow.state() != StartFlow::State::kChoosing) {
    draw_waiting(flow);
    return ImGui::End();
  }
  ImGui::SetWindowFontScale(1.5F);
  ImGui::TextColored(kTitle, "Tandem");
  ImGui::SetWindowFontScale(1);
  draw_guide_button(form);
  draw_problem(flow.problem(), form.wants_guide);
  const bool is_wide = size.x > kTwoColumnsEm * em();
  if (is_wide) {
    const float width = ImGui::GetContentRegionAvail().x - (kFormsEm + 1.2F) * em();
    draw_in_child(
        "scenes", [&] { draw_scenes(flow, pictures); }, width);
    ImGui::SameLine(0, 1.2F * em());
  }
  if (is_wide) {
    draw_in_child("forms", [&] { draw_forms(flow, form); });
  } else if (ImGui::BeginTabBar("parts")) {
    if (ImGui::BeginTabItem("Scenes")) {
      draw_in_child("scenes", [&] { draw_scenes(flow, pictures); });
      ImGui::EndTabItem();
    }
    if (ImGui::BeginTabItem("Join, host, open a file")) {
      draw_in_child("forms", [&] { draw_forms(flow, form); });
      ImGui::EndTabItem();
    }
    ImGui::EndTabBar();
  }
  ImGui::End();
}

StartScreen::StartScreen(Screen& screen, StartForm& form)
    : screen_(screen), form_(form), pictures_(std::make_unique<ScenePictures>(data_folder() / "pictures")) {
  screen_.set_title("tandem: start");
  form_.guide = remembered_switches(window_memory_file()).guide;
  screen_.take_dropped();  // discards files that were dropped during a session
}

StartScreen::~StartScreen() = default;

void StartScreen::draw(StartFlow& flow) {
  screen_.begin_frame();
  screen_.take_keys();
  screen_.pop_double_click();
  for (const std::filesystem::path& file : screen_.take_dropped()) {
    // A dropped file replaces only its own field. The form may be older than the text that the user has typed into the
    // other fields, so this text is copied to the form first.
    StartChoice& choice = flow.form();
    choice.mesh = form_.file.data();
    choice.receptor = form_.receptor.data();
    choice.ligand = form_.ligand.data();
    flow.drop(file);
    put(form_.file, flow.form().mesh);
    put(form_.receptor, flow.form().receptor);
    put(form_.ligand, flow.form().ligand);
  }
  flow.poll();
  glViewport(0, 0, screen_.width(), screen_.height());
  glClearColor(0.07F, 0.09F, 0.11F, 1);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  draw_start(flow, form_, pictures_.get());
  screen_.end_frame();
}

}  // namespace tandem::client
