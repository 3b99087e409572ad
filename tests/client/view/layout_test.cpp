// Tests the layout of a frame at several window sizes. Every text that Dear ImGui draws must not overlap another text,
// nor exceed the window or its clip rectangle. No display is needed.
#include <gtest/gtest.h>
#include <imgui.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "client/haptics/stages/stage.hpp"
#include "client/view/guide/guide_card.hpp"
#include "client/view/panels.hpp"
#include "client/view/screen/menu.hpp"
#include "client/view/screen/sentences.hpp"
#include "client/view/screen/start_screen.hpp"
#include "client/view/screen/style.hpp"

namespace tandem::client {
namespace {

struct Size {
  float width, height, scale;
};
constexpr Size kSizes[] = {{500, 500, 1},   {800, 600, 1},   {1280, 900, 1},
                           {1000, 1000, 2}, {1600, 1200, 2}, {2560, 1800, 2}};

struct Glyph {
  ImVec2 from, to;  ///< the drawn rectangle
  ImVec4 clip;      ///< left, top, right, bottom of the clip rectangle
  int list = 0;
};

/// Returns the boxes of all glyphs of a frame. Among the drawn quads, a glyph is one whose corners have different
/// texture coordinates.
std::vector<Glyph> glyphs_of(const ImDrawData& data) {
  std::vector<Glyph> glyphs;
  for (int l = 0; l < data.CmdListsCount; ++l) {
    const ImDrawList& list = *data.CmdLists[l];
    for (const ImDrawCmd& command : list.CmdBuffer) {
      for (unsigned i = 0; i + 5 < command.ElemCount;) {
        const ImDrawIdx* const index = list.IdxBuffer.Data + command.IdxOffset + i;
        const bool is_quad = index[1] == index[0] + 1 && index[2] == index[0] + 2 && index[3] == index[0] &&
                             index[4] == index[2] && index[5] == index[0] + 3;
        const ImDrawVert* const corner = list.VtxBuffer.Data + command.VtxOffset + index[0];
        if (is_quad && corner[0].uv.x != corner[2].uv.x && corner[0].uv.y != corner[2].uv.y) {
          glyphs.push_back({corner[0].pos, corner[2].pos, command.ClipRect, l});
        }
        i += is_quad ? 6 : 3;
      }
    }
  }
  return glyphs;
}

double area(const ImVec2& from, const ImVec2& to) {
  return std::max(0.0, static_cast<double>(to.x - from.x)) * std::max(0.0, static_cast<double>(to.y - from.y));
}

/// The visible part of a glyph.
Glyph shown(Glyph glyph) {
  glyph.from = {std::max(glyph.from.x, glyph.clip.x), std::max(glyph.from.y, glyph.clip.y)};
  glyph.to = {std::min(glyph.to.x, glyph.clip.z), std::min(glyph.to.y, glyph.clip.w)};
  return glyph;
}

/// Describes glyphs that overlap each other by more than a quarter, or that are cut off by the window's edge or a side
/// of their clip rectangle.
std::string problems_of(const ImDrawData& data, const Size& size) {
  std::string problems;
  std::vector<Glyph> visible;
  const auto say = [&problems](const char* what, const Glyph& glyph) {
    if (problems.size() < 600) {
      problems +=
          std::string(what) + " at " + std::to_string(glyph.from.x) + ", " + std::to_string(glyph.from.y) + "\n";
    }
  };
  for (const Glyph& glyph : glyphs_of(data)) {
    const Glyph part = shown(glyph);
    const double whole = area(glyph.from, glyph.to);
    if (area(part.from, part.to) <= 0) continue;  // scrolled out of sight
    visible.push_back(part);
    const bool is_high_enough = part.to.y - part.from.y > 0.9F * (glyph.to.y - glyph.from.y);
    if (is_high_enough && area(part.from, part.to) < 0.8 * whole) say("cut at its side", glyph);
    if (glyph.to.x > size.width + 1 || glyph.from.x < -1) say("outside of the window", glyph);
  }
  for (std::size_t i = 0; i < visible.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const Glyph &a = visible[i], &b = visible[j];
      const double both = area({std::max(a.from.x, b.from.x), std::max(a.from.y, b.from.y)},
                               {std::min(a.to.x, b.to.x), std::min(a.to.y, b.to.y)});
      if (both > 0.25 * std::min(area(a.from, a.to), area(b.from, b.to))) say("two glyphs in one place", a);
    }
  }
  return problems;
}

class Layout : public testing::TestWithParam<Size> {
 protected:
  Layout() {
    ImGui::CreateContext();
    ImGuiIO& io = ImGui::GetIO();
    io.DisplaySize = {GetParam().width, GetParam().height};
    apply_style(GetParam().scale);
    ImGui::GetStyle().AntiAliasedLinesUseTex = false;  // otherwise lines would be drawn like glyphs
    unsigned char* pixels = nullptr;
    int width = 0, height = 0;
    io.Fonts->GetTexDataAsRGBA32(&pixels, &width, &height);
    joined_ = std::make_shared<wire::Joined>();
    joined_->set_role(wire::ROLE_OPERATOR);
    joined_->mutable_scene()->set_name("a scene with a long name");
    joined_->mutable_scene()->mutable_coupling()->set_law("spring-damper");
    io_.joined = joined_;
    io_.status.state = SessionState::kActive;
    io_.law = "spring-damper";
    io_.room = "room";
    io_.rooms = {"room", "another room"};
    for (const char* name : {"ben", "a user with quite a long name"}) io_.users.emplace_back().set_name(name);
    view_.record.sample.is_valid = true;
    switches_.is_open.fill(true);
  }
  ~Layout() override { ImGui::DestroyContext(); }

  /// Draws some frames, because windows fit their size to the content one frame later. Returns the problems of the last
  /// frame.
  template <class Draw>
  std::string problems(const Draw& draw) {
    for (int frame = 0; frame < 4; ++frame) {
      ImGui::GetIO().DeltaTime = 1.0F / 60;
      ImGui::NewFrame();
      draw();
      ImGui::Render();
    }
    return problems_of(*ImGui::GetDrawData(), GetParam());
  }
  PanelContent content() {
    PanelContent content;
    content.view = &view_;
    content.io = &io_;
    content.figures = &figures_;
    content.facts = &facts_;
    content.missing = &missing_;
    content.is_mouse = true;
    content.recording_state = &text_;
    content.recording_folder = &text_;
    return content;
  }
  StartFlow flow_{"/nonexistent", ""};
  StartForm form_;
  std::shared_ptr<wire::Joined> joined_;
  ClientIoSnapshot io_;
  View view_;
  Figures figures_;
  std::vector<std::pair<std::string, std::string>> facts_{{"you", "anna, operator"}, {"device", "mouse, as mouse"}};
  std::vector<std::string> missing_;
  std::string text_;
  WindowSwitches switches_;
  net::LinkParameters link_;
  WorkspaceSettings workspace_;
  MenuState menu_;
};

TEST_P(Layout, TheStartScreenFits) {
  form_.devices = {"Your hand: mouse.", "Found: falcon at usb 1-2, but its rights are missing; see tandem-doctor"};
  EXPECT_EQ(problems([this] { draw_start(flow_, form_, nullptr); }), "");
  form_.guide = {.is_on = true, .step = GuideStep::kCompare};
  form_.wants_guide = true;
  EXPECT_EQ(problems([this] { draw_start(flow_, form_, nullptr); }), "") << "waits for the server of the guide";
  flow_.form().is_hosted = true;
  EXPECT_EQ(problems([this] { draw_start(flow_, form_, nullptr); }), "") << "hosting";
  flow_.open({.kind = StartChoice::Kind::kMesh, .mesh = "/a/rather/long/path/of/a/file/that/does/not/exist/part.stl"});
  EXPECT_EQ(problems([this] { draw_start(flow_, form_, nullptr); }), "") << "with a problem";
}

TEST_P(Layout, TheSessionFitsAndItsCentreIsFree) {
  const auto draw = [this] {
    draw_menu({.shows_panels = true}, menu_);
    draw_panels(content(), switches_, link_, workspace_);
  };
  EXPECT_EQ(problems(draw), "");
  EXPECT_GT(GetParam().width - panels_width(), GetParam().width / 2) << "the middle of the window";
  switches_.is_open.fill(false);
  EXPECT_EQ(problems(draw), "") << "without details";
}

TEST_P(Layout, TheMoleculesFit) {
  auto molecule = std::make_shared<docking::Molecule>();
  molecule->positions_angstrom = {{0, 0, 0}, {0, 0, 9.25}};
  molecule->mass_u = {12, 1};
  molecule->atom_names = {"CA", "H161"};
  molecule->residue_names = {"GLU", "TRP"};
  molecule->residue_ids = {"1024A", "7"};
  molecule->chains = {"AA", "AA"};
  molecule->segments = {0, 0};
  DrawnScene scene;
  scene.bodies.emplace_back().molecule = molecule;
  for (std::size_t i = 0; i < DrawnScene::kMaxLegend; ++i)
    scene.legend.push_back({"chain " + std::to_string(i), chain_color(i)});
  scene.legend_omitted = 16;
  MoleculeMouse mouse;
  const std::vector<Pose> X_WB(1);
  for (const double z : {0.0, 9.25}) {
    mouse.follow({.scene = scene, .X_WB = X_WB, .from_W = Vec3(-20, 0, z), .along_W = Vec3::UnitX(), .is_click = true});
  }
  figures_.has_molecules = true;
  switches_.is_open.fill(false);
  switches_.is_open[5] = true;
  PanelContent shown = content();
  shown.molecules = mouse.content(scene);
  ASSERT_NE(shown.molecules.distance, "");
  ASSERT_NE(shown.molecules.under_mouse, "");
  const auto draw = [&] { draw_panels(shown, switches_, link_, workspace_); };
  EXPECT_EQ(problems(draw), "");
  *shown.molecules.problem = "No residue is A:10-25. The chains are A, B, C, D, E, F, G, H, I, J, K, L, M, N, O.";
  EXPECT_EQ(problems(draw), "") << "with a problem";
}

TEST_P(Layout, AMessageHidesNoControl) {
  PanelContent with_notice = content();
  with_notice.notice = "No force: the server has not sent for 150 ms at [2001:db8::1]:47800. It returns when it sends.";
  EXPECT_EQ(problems([&] {
              draw_menu({.shows_panels = true}, menu_);
              draw_panels(with_notice, switches_, link_, workspace_);
            }),
            "");
}

TEST_P(Layout, TheCardOfTheGuideFitsAndHidesNothingThatIsClicked) {
  const auto free = [] { return GetParam().width - static_cast<float>(panels_width()); };
  PanelContent with_notice = content();
  with_notice.notice = "No force: the server has not sent for 150 ms. The force returns when it sends again.";
  std::vector<GuideCard> cards{{.is_in_scene = false}};
  for (std::size_t i = 0; i < kGuideStepNames.size(); ++i) {
    for (const bool is_mouse : {false, true}) {
      cards.push_back({.step = static_cast<GuideStep>(i), .is_mouse = is_mouse});
    }
  }
  for (const GuideCard& card : cards) {
    EXPECT_EQ(problems([&] {
                draw_menu({.shows_panels = true}, menu_);
                draw_panels(with_notice, switches_, link_, workspace_);
                draw_guide(card, free());
              }),
              "")
        << guide_title(card.step);
  }
  ImGui::NewFrame();
  const ImVec4 place = guide_place(free());
  const float width = free();
  ImGui::EndFrame();
  EXPECT_GE(place.x, 0);
  EXPECT_LE(place.z, width) << "beside the panel";
  EXPECT_LE(place.w, GetParam().height);
  EXPECT_GT(place.y, 0.7 * GetParam().height) << "below the crate, which is in the middle";
}

TEST_P(Layout, AMessageClosesNoMenu) {
  PanelContent shown = content();
  const auto draw = [&] {
    draw_menu({.shows_panels = true}, menu_);
    draw_panels(shown, switches_, link_, workspace_);
  };
  const auto is_menu_open = [] { return ImGui::IsPopupOpen("", ImGuiPopupFlags_AnyPopup); };
  problems(draw);
  ImGuiIO& io = ImGui::GetIO();
  io.MousePos = {2 * ImGui::GetFontSize(), static_cast<float>(menu_height()) / 2};
  for (const bool is_down : {false, true, false}) {
    io.MouseDown[0] = is_down;
    problems(draw);
  }
  ASSERT_TRUE(is_menu_open());
  shown.notice = "No force: the server has not sent for 150 ms.";
  problems(draw);
  EXPECT_TRUE(is_menu_open());
}

TEST_P(Layout, HelpFitsIntoTheWindow) {
  switches_.shows_help = true;
  switches_.shows_panels = false;
  figures_.has_molecules = true;
  EXPECT_EQ(problems([this] { draw_panels(content(), switches_, link_, workspace_); }), "");
}

TEST_P(Layout, InvitationsFit) {
  const std::vector<std::string> invitations(3, "192.0.2.2:47800/" + std::string(300, 'x'));
  switches_.shows_panels = false;
  EXPECT_EQ(problems([&] { draw_menu({.shows_panels = false, .invitations = &invitations}, menu_); }), "");
}

INSTANTIATE_TEST_SUITE_P(Sizes, Layout, testing::ValuesIn(kSizes), [](const auto& tested) {
  return std::to_string(static_cast<int>(tested.param.width)) + "x" +
         std::to_string(static_cast<int>(tested.param.height)) + "at" +
         std::to_string(static_cast<int>(tested.param.scale));
});

TEST(LayoutProblems, AreFoundWhereTextsOverlapOrAreCut) {
  ImGui::CreateContext();
  apply_style(1);
  ImGuiIO& io = ImGui::GetIO();
  io.DisplaySize = {300, 200};
  io.DeltaTime = 0.02F;
  unsigned char* pixels = nullptr;
  int width = 0, height = 0;
  io.Fonts->GetTexDataAsRGBA32(&pixels, &width, &height);
  const auto draw = [](float x, float y) {
    ImGui::NewFrame();
    ImGui::GetForegroundDrawList()->AddText({20, 20}, IM_COL32_WHITE, "first");
    ImGui::GetForegroundDrawList()->AddText({x, y}, IM_COL32_WHITE, "second");
    ImGui::Render();
    return problems_of(*ImGui::GetDrawData(), {300, 200, 1});
  };
  EXPECT_EQ(draw(20, 60), "");
  EXPECT_NE(draw(22, 23).find("two glyphs in one place"), std::string::npos);
  EXPECT_NE(draw(275, 60).find("outside of the window"), std::string::npos);
  ImGui::DestroyContext();
}

TEST(Sentences, EveryStageHasOne) {
  for (const std::string_view name : stage_names()) EXPECT_NE(stage_sentence(name), "") << name;
  EXPECT_EQ(stage_sentence("telepathy"), "");
}

TEST(Sentences, SayWhoIsHereAndHowLongTheWayIs) {
  ClientIoSnapshot io;
  auto joined = std::make_shared<wire::Joined>();
  joined->set_role(wire::ROLE_OPERATOR);
  io.joined = joined;
  EXPECT_EQ(people_sentence(io), "You are the operator, alone.");
  io.users.emplace_back().set_name("ben");
  EXPECT_EQ(people_sentence(io), "You are the operator, with ben.");
  EXPECT_EQ(delay_sentence(2.4, Duration{0}), "2 ms there and back.");
  EXPECT_EQ(delay_sentence(52, std::chrono::milliseconds(25)),
            "52 ms there and back, of which 50 ms are simulated here.");
}

TEST(Sentences, SayWhyThereIsNoForceAndWhatHelps) {
  ClientIoSnapshot io;
  auto joined = std::make_shared<wire::Joined>();
  joined->set_role(wire::ROLE_MANIPULATOR);
  io.joined = joined;
  View view;
  EXPECT_EQ(force_problem(&view, io), "");
  view.record.safety_faults = haptics::kSafetyRamping | haptics::kSafetySlewed;
  EXPECT_EQ(force_problem(&view, io), "") << "they end by themselves";
  view.record.safety_faults = haptics::kSafetySilence | haptics::kSafetyRamping;
  EXPECT_NE(force_problem(&view, io).find("has not sent for 150 ms"), std::string::npos);
  view.record.safety_faults |= haptics::kSafetyInvalidSample;
  EXPECT_NE(force_problem(&view, io).find("cable"), std::string::npos) << "the more important one";
}

}  // namespace
}  // namespace tandem::client
