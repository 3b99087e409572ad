// The rooms of a server, and the services that run beside them on other threads. One owner enforces the order of
// destruction.
//
//   LiveServer ─owns─▶ ServerRooms ─owns─▶ rooms
//        │                  └──────owns─▶ services (recorder, checkpoint, poses, metrics): use rooms, destroyed first
//        └─owns─▶ scheduler, hub, sockets: refer to rooms and services, destroyed before both
#pragma once

#include <exception>
#include <memory>
#include <utility>
#include <vector>

#include "server/room/room.hpp"

namespace tandem::server {

/// A service beside a server's rooms, mostly on a separate thread. It may refer to the rooms until it is destroyed.
class RoomService {
 public:
  virtual ~RoomService() = default;
  /// Completes or discards queued work, and joins the thread of the service. Called after the last step of each room
  /// and the last call from the io thread, even if the io thread has thrown an exception. Repeated calls have no
  /// effect. The destructor of the service does the same work if finish() was never called.
  virtual void finish() = 0;
};

class ServerRooms {
 public:
  ServerRooms() = default;
  // The constructor is not explicit, so that rooms without services convert to a ServerRooms.
  ServerRooms(std::vector<std::unique_ptr<Room>> rooms) : rooms_(std::move(rooms)) {}
  ServerRooms(ServerRooms&&) = default;
  ServerRooms& operator=(ServerRooms&&) = delete;  // deleted: it would destroy the old rooms before their services
  ~ServerRooms() {
    while (!services_.empty()) services_.pop_back();
  }

  const std::vector<std::unique_ptr<Room>>& rooms() const { return rooms_; }
  /// Adds a service and returns it; null is returned unchanged. A service may refer to services that were added before
  /// it.
  template <class Service>
  Service* add(std::unique_ptr<Service> service) {
    Service* const added = service.get();
    if (added != nullptr) services_.push_back(std::move(service));
    return added;
  }
  /// Calls RoomService::finish() of each service in the order of addition, even if one of them throws.
  /// Fails   rethrows the first exception
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
