// The rooms of a server, and what works beside them on threads of its own: one owner, so that the order of destruction is right
// by construction.
//
//   LiveServer ─owns─▶ ServerRooms ─owns─▶ rooms
//        │                  └──────owns─▶ services (recorder, checkpoint, poses, metrics): refer to the rooms, destroyed first
//        └─owns─▶ scheduler, hub, sockets: refer to rooms and services, destroyed before both
#pragma once

#include <exception>
#include <memory>
#include <utility>
#include <vector>

#include "server/room/room.hpp"

namespace tandem::server {

/// Work beside a server's rooms, mostly on a thread of its own. It may refer to the rooms until it is destroyed.
class RoomService {
 public:
  virtual ~RoomService() = default;
  /// After the last step of each room and the last call from the io thread, also when that thread ended by an exception: writes
  /// or drops the work that waits, and joins the thread. Idempotent. A service that never finished does so when it is destroyed.
  virtual void finish() = 0;
};

class ServerRooms {
 public:
  ServerRooms() = default;
  // Not explicit: most callers have rooms only.
  ServerRooms(std::vector<std::unique_ptr<Room>> rooms) : rooms_(std::move(rooms)) {}
  ServerRooms(ServerRooms&&) = default;
  ServerRooms& operator=(ServerRooms&&) = delete;  // it would destroy rooms before their services
  ~ServerRooms() {
    while (!services_.empty()) services_.pop_back();
  }

  const std::vector<std::unique_ptr<Room>>& rooms() const { return rooms_; }
  /// Null in, null out. A later service may refer to an earlier one.
  template <class Service>
  Service* add(std::unique_ptr<Service> service) {
    Service* const added = service.get();
    if (added != nullptr) services_.push_back(std::move(service));
    return added;
  }
  /// RoomService::finish() of each, in the order in which they were added, whatever one of them throws.
  /// Fails   what the first of them threw
  void finish() {
    std::exception_ptr fault;
    for (const auto& service : services_) {
      try {
        service->finish();
      } catch (...) {
        if (fault == nullptr) fault = std::current_exception();
      }
    }
    if (fault != nullptr) std::rethrow_exception(fault);
  }

 private:
  std::vector<std::unique_ptr<Room>> rooms_;
  std::vector<std::unique_ptr<RoomService>> services_;
};

}  // namespace tandem::server
