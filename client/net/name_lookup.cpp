#include "client/net/name_lookup.hpp"

#include <netdb.h>
#include <netinet/in.h>

#include <algorithm>
#include <array>
#include <boost/asio/post.hpp>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include "common/net/socket_rules.hpp"
#include "common/realtime/realtime.hpp"

namespace tandem::client {
namespace {

namespace ip = boost::asio::ip;

net::Address address_in(const addrinfo& found) {
  if (found.ai_family == AF_INET) {
    const auto& v4 = *reinterpret_cast<const sockaddr_in*>(found.ai_addr);
    return ip::address_v4(ntohl(v4.sin_addr.s_addr));
  }
  const auto& v6 = *reinterpret_cast<const sockaddr_in6*>(found.ai_addr);
  ip::address_v6::bytes_type bytes{};
  std::copy_n(v6.sin6_addr.s6_addr, bytes.size(), bytes.begin());
  return ip::address_v6(bytes, v6.sin6_scope_id);
}

}  // namespace

std::vector<net::Address> resolve_by_system(const std::string& host, bool is_v6, std::string& problem) {
  addrinfo hints{};
  hints.ai_family = is_v6 ? AF_INET6 : AF_INET;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* list = nullptr;
  const int error = ::getaddrinfo(host.c_str(), nullptr, &hints, &list);
  std::vector<net::Address> addresses;
  for (const addrinfo* one = list; one != nullptr; one = one->ai_next) {
    if (one->ai_family == hints.ai_family) addresses.push_back(address_in(*one));
  }
  if (list != nullptr) ::freeaddrinfo(list);
  const bool is_unknown = error == 0 || error == EAI_NONAME || error == EAI_NODATA || error == EAI_ADDRFAMILY;
  if (addresses.empty()) problem = is_unknown ? "host not found" : net::lower_first(::gai_strerror(error));
  return addresses;
}

/// State shared with the look-up threads, which may outlive the NameLookup object.
struct NameLookup::State {
  std::mutex mutex;             // protects `io`
  boost::asio::io_context* io;  ///< null after the destruction of the NameLookup
  Resolve resolve;
  Answer answer;
  std::array<bool, 2> is_outstanding{};  ///< used by the io thread only; index 0 is IPv4, index 1 is IPv6
};

NameLookup::NameLookup(boost::asio::io_context& io, Resolve resolve, Answer answer)
    : state_(std::make_shared<State>()) {
  state_->io = &io;
  state_->resolve = std::move(resolve);
  state_->answer = std::move(answer);
}

NameLookup::~NameLookup() {
  const std::scoped_lock lock(state_->mutex);
  state_->io = nullptr;
}

void NameLookup::start(const std::string& host) {
  for (const bool is_v6 : {true, false}) {
    if (std::exchange(state_->is_outstanding.at(is_v6 ? 1 : 0), true)) continue;
    const auto finish = [state = state_, is_v6](const std::vector<net::Address>& addresses,
                                                const std::string& problem) {
      const std::scoped_lock lock(state->mutex);
      if (state->io == nullptr) return;
      boost::asio::post(*state->io, [weak = std::weak_ptr(state), is_v6, addresses, problem] {
        const auto still = weak.lock();
        if (still == nullptr || still->io == nullptr) return;
        still->is_outstanding.at(is_v6 ? 1 : 0) = false;
        still->answer(addresses, is_v6, problem);
      });
    };
    try {
      std::thread([state = state_, host, is_v6, finish] {
        // The new thread has inherited the real-time priority of the io thread.
        realtime::drop_realtime();
        std::string problem;
        const std::vector<net::Address> addresses = state->resolve(host, is_v6, problem);
        finish(addresses, problem);
      }).detach();
    } catch (const std::system_error& error) {
      finish({}, std::string("the look-up could not be started: ") + error.what());
    }
  }
}

}  // namespace tandem::client
