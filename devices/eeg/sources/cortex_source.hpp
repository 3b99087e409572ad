// Reads EEG of an Emotiv headset from the Cortex service on the same machine.
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>

#include "devices/eeg/sources/eeg_source.hpp"

namespace tandem::eeg {

/// Credentials of an application that is registered with Emotiv. They are read from a file, because other users of the
/// machine can read command lines.
struct CortexCredentials {
  std::string client_id;
  std::string client_secret;
};

/// Reads a JSON file with {"client_id": "…", "client_secret": "…"}.
/// Fails   std::invalid_argument: the message names the file, the field and the remedy
CortexCredentials read_cortex_credentials(const std::filesystem::path& file);

struct CortexSettings {
  std::string url = "wss://localhost:6868";  ///< the address must belong to this machine
  CortexCredentials credentials;
  std::string headset;                                  ///< id of the headset; empty: the first one
  Duration answer_within = std::chrono::seconds(10);    ///< time limit of each request
  Duration headset_within = std::chrono::seconds(30);   ///< time limit until the headset is connected
  Duration approved_within = std::chrono::seconds(60);  ///< time limit until the user approves the application
  Duration silent_for = std::chrono::seconds(5);        ///< time without a sample until the headset counts as lost
};

/// Opens a session with these calls of the Cortex API: requestAccess, authorize, queryHeadsets, controlDevice,
/// createSession, subscribe.
///
/// Only addresses of this machine are accepted. The service's certificate is self-signed and cannot be verified, so a
/// remote machine could impersonate the service.
///
/// Fails   std::invalid_argument: the URL is not on this machine; std::runtime_error: a call failed. The message names
///         the call and the remedy
std::unique_ptr<EegSource> open_cortex(const CortexSettings& settings);

}  // namespace tandem::eeg
