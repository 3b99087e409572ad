// EEG of an Emotiv headset, from the Cortex service on the same machine.
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>

#include "devices/eeg/sources/eeg_source.hpp"

namespace tandem::eeg {

/// Identity of the application at Emotiv. It is read from a file, because other users can read a command line.
struct CortexCredentials {
  std::string client_id;
  std::string client_secret;
};

/// Reads {"client_id": "…", "client_secret": "…"}.
/// Fails   std::invalid_argument: the message names the file, the field and the remedy
CortexCredentials read_cortex_credentials(const std::filesystem::path& file);

struct CortexSettings {
  std::string url = "wss://localhost:6868";  ///< must be on this machine
  CortexCredentials credentials;
  std::string headset;                                  ///< id of the headset; empty: the first one
  Duration answer_within = std::chrono::seconds(10);    ///< for each request
  Duration headset_within = std::chrono::seconds(30);   ///< until the headset is connected
  Duration approved_within = std::chrono::seconds(60);  ///< until the user approves the application
  Duration silent_for = std::chrono::seconds(5);        ///< without a sample the headset counts as lost
};

/// Opens a session: requestAccess, authorize, queryHeadsets, controlDevice, createSession, subscribe.
///
/// The service's certificate is self-signed and cannot be verified. Therefore only addresses of this machine are
/// accepted, where no other machine can take the service's place.
///
/// Fails   std::invalid_argument: the URL is not on this machine; std::runtime_error: a step failed. The message names
///         the step and the remedy
std::unique_ptr<EegSource> open_cortex(const CortexSettings& settings);

}  // namespace tandem::eeg
