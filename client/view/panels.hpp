// The panels beside the scene: session, network, curves and help.
#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "client/haptics/view.hpp"
#include "client/net/client_io.hpp"
#include "client/view/drawn_mesh.hpp"
#include "client/view/figures.hpp"
#include "client/view/guide/guide.hpp"
#include "client/view/molecule/molecule_mouse.hpp"

namespace tandem::client {

/// Settings that the user can switch. The window stores them from one run to the next.
struct WindowSwitches {
  bool shows_help = false;
  bool shows_panels = true;
  bool shows_ghosts = false;
  bool shows_contacts = true;
  bool follows_tool = false;
  bool cuts = false;       ///< true: objects that are nearer than the cutting plane are hidden
  double cut_share = 0.5;  ///< position of the cutting plane: 0 in front of the focus ball, 1 behind it
  MoleculeStyle molecules{};
  GuideProgress guide{};
  bool has_sound = true;  ///< true: short sounds are played at contact; only with the device "mouse"
  /// Whether each section of the panels is open: session, network, touch, stage, view, molecules, hand, details.
  std::array<bool, 8> is_open{true, true, true, true, true, true, false, false};
  std::array<char, 65> pose_name{};      ///< input field for the name of a pose to be saved; not stored
  std::array<char, 65> residues{};       ///< input field for residues to be selected; not stored
  std::array<char, 65> new_pose_name{};  ///< input field for a new name of a saved pose; not stored
};

struct PanelContent {
  ClientIo* client = nullptr;  ///< receives the user's requests
  const View* view = nullptr;
  const ClientIoSnapshot* io = nullptr;
  const Figures* figures = nullptr;
  const std::vector<std::pair<std::string, std::string>>* facts = nullptr;  ///< names and values that describe the run
  const std::vector<std::string>* missing = nullptr;                        ///< objects of the scene that are not drawn
  std::string notice{};                                                     ///< text for the top of the window
  bool is_mouse = false;
  double camera_turn_rad = 0;        ///< azimuth of the camera (Camera::turn_rad())
  bool is_making_molecules = false;  ///< true: the meshes of molecules in a new style are being made
  bool is_recording = false;
  const std::string* recording_state = nullptr;   ///< state of the recording, as text
  const std::string* recording_folder = nullptr;  ///< folder for the next recording
  bool* is_record_pressed = nullptr;              ///< output: set to true when the button for recordings is pressed
  MoleculeContent molecules{};
};

/// Draws the panels in the current ImGui context.
/// In      link       parameters of the simulated link, changed by the sliders
///         workspace  mapping of the hand, changed by the sliders
/// Thread  the one that runs the window
void draw_panels(const PanelContent& content, WindowSwitches& switches, net::LinkParameters& link,
                 WorkspaceSettings& workspace);

/// Formats a number as printf does.
std::string text_of(const char* format, double value);

/// Sends a pose request in a room of two molecules. In other rooms the server refuses it.
void ask_pose(ClientIo* client, wire::AskPose::Kind kind, std::uint32_t number = 0, const char* name = "");
/// Saves the current pose under the entered name.
void keep_pose(ClientIo* client, WindowSwitches& switches);
/// Draws the section of the panels for saved poses (pose_panel.cpp).
void draw_poses(const PanelContent& content, WindowSwitches& switches);

/// Draws the part of the panels for atoms and residues (molecule/residue_panel.cpp).
void draw_residues(const MoleculeContent& content, WindowSwitches& switches);

/// Width of the panels at the right side of the window, in ImGui's pixels.
double panels_width();

/// Problem of the session as text for the user; empty if there is none.
std::string session_problem(const ClientIoSnapshot& io);

}  // namespace tandem::client
