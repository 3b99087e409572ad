// The panels beside the scene: session, network, curves, help.
#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "client/haptics/view.hpp"
#include "client/net/client_io.hpp"
#include "client/view/drawn_mesh.hpp"
#include "client/view/figures.hpp"

namespace tandem::client {

/// What users switch, and a window remembers.
struct WindowSwitches {
  bool shows_help = false;
  bool shows_panels = true;
  bool shows_ghosts = false;
  bool shows_contacts = true;
  bool follows_tool = false;
  bool cuts = false;       ///< away what is nearer than a plane
  double cut_share = 0.5;  ///< where that is: 0 before, 1 behind the ball that is looked at
  MoleculeStyle molecules{};
  /// Of the panels' parts: session, network, touch, stage, view, molecules, hand.
  std::array<bool, 7> is_open{true, true, true, true, true, true, false};
  std::array<char, 65> pose_name{};      ///< being typed, of a pose to be kept; not remembered
  std::array<char, 65> new_pose_name{};  ///< likewise, of one that is kept
};

struct PanelContent {
  ClientIo* client = nullptr;  ///< what is asked for goes there
  const View* view = nullptr;
  const ClientIoSnapshot* io = nullptr;
  const Figures* figures = nullptr;
  const std::vector<std::pair<std::string, std::string>>* facts = nullptr;  ///< of the run: what and which
  const std::vector<std::string>* missing = nullptr;                        ///< of the scene, in the picture
  std::string notice;                                                       ///< for the top of the window
  bool is_mouse = false;
  double looks_from_rad = 0;         ///< Camera::turn_rad()
  bool is_making_molecules = false;  ///< those of another style
  bool is_recording = false;
  const std::string* recording_state = nullptr;   ///< in words
  const std::string* recording_folder = nullptr;  ///< of the next one
  bool* is_record_pressed = nullptr;              ///< set by the button
};

/// With the ImGui context that is current.
/// In      link  the simulated link; workspace  the hand's: the sliders write them
/// Thread  the window's
void draw_panels(const PanelContent& content, WindowSwitches& switches, net::LinkParameters& link,
                 WorkspaceSettings& workspace);

/// A number as printf writes it.
std::string text_of(const char* format, double value);

/// Of a room of two molecules; the server refuses it where it cannot be.
void ask_pose(ClientIo* client, wire::AskPose::Kind kind, std::uint32_t number = 0, const char* name = "");
/// Keeps the pose of now under the name that was typed.
void keep_pose(ClientIo* client, WindowSwitches& switches);
/// Their part of the panels (pose_panel.cpp).
void draw_poses(const PanelContent& content, WindowSwitches& switches);

/// What they take of the window's width, at its right, in ImGui's pixels.
double panels_width();

/// In words, for a window: empty while all is well.
std::string session_problem(const ClientIoSnapshot& io);

}  // namespace tandem::client
