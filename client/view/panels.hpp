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

/// Switches of the user, remembered by the window.
struct WindowSwitches {
  bool shows_help = false;
  bool shows_panels = true;
  bool shows_ghosts = false;
  bool shows_contacts = true;
  bool follows_tool = false;
  bool cuts = false;       ///< hides objects nearer than a plane
  double cut_share = 0.5;  ///< position of the plane: 0 in front of, 1 behind the focus ball
  MoleculeStyle molecules{};
  /// Open parts of the panels: session, network, touch, stage, view, molecules, hand.
  std::array<bool, 7> is_open{true, true, true, true, true, true, false};
  std::array<char, 65> pose_name{};      ///< input field for a pose to be kept; not remembered
  std::array<char, 65> new_pose_name{};  ///< input field for a new name of a kept pose; not remembered
};

struct PanelContent {
  ClientIo* client = nullptr;  ///< receives the user's requests
  const View* view = nullptr;
  const ClientIoSnapshot* io = nullptr;
  const Figures* figures = nullptr;
  const std::vector<std::pair<std::string, std::string>>* facts = nullptr;  ///< names and values about the run
  const std::vector<std::string>* missing = nullptr;  ///< objects of the scene that are not in the picture
  std::string notice;                                 ///< for the top of the window
  std::string news;                                   ///< last news of the room
  bool is_mouse = false;
  double camera_turn_rad = 0;        ///< Camera::turn_rad()
  bool is_making_molecules = false;  ///< molecules in another style are being made
  bool is_recording = false;
  const std::string* recording_state = nullptr;   ///< in words
  const std::string* recording_folder = nullptr;  ///< folder of the next recording
  bool* is_record_pressed = nullptr;              ///< set by the button
};

/// Draws the panels in the current ImGui context.
/// In      link       simulated link, changed by the sliders
///         workspace  of the hand, changed by the sliders
/// Thread  the window's
void draw_panels(const PanelContent& content, WindowSwitches& switches, net::LinkParameters& link,
                 WorkspaceSettings& workspace);

/// Formats a number as printf does.
std::string text_of(const char* format, double value);

/// Sends a pose request in a room of two molecules; the server refuses it elsewhere.
void ask_pose(ClientIo* client, wire::AskPose::Kind kind, std::uint32_t number = 0, const char* name = "");
/// Keeps the present pose under the typed name.
void keep_pose(ClientIo* client, WindowSwitches& switches);
/// Draws the poses' part of the panels (pose_panel.cpp).
void draw_poses(const PanelContent& content, WindowSwitches& switches);

/// Width of the panels at the window's right, in ImGui's pixels.
double panels_width();

/// Problem of the session as text for the user; empty if there is none.
std::string session_problem(const ClientIoSnapshot& io);

}  // namespace tandem::client
