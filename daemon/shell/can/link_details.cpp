#include "daemon/shell/can/link_details.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <optional>
#include <string_view>

#include <libmnl/libmnl.h>
#include <linux/can/netlink.h>
#include <linux/if.h>
#include <linux/if_link.h>
#include <linux/rtnetlink.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include "daemon/shell/system/owned_fd.hpp"

namespace bmu {

namespace {

using Bytes = std::span<const std::byte>;

// An answer about one interface is some 2 KiB; longer ones are refused, not cut.
constexpr std::size_t answer_bytes_max = 32'768;
struct AnswerRoom {
  alignas(nlmsghdr) std::array<std::byte, answer_bytes_max> bytes{};
};

/// The first attribute of each type up to `type_max`; null if there is none.
template <std::uint16_t type_max>
struct Attributes {
  std::array<const nlattr*, type_max + std::size_t{1}> of{};
};

/// An mnl_attr_cb_t. Skips types of later kernels.
template <std::uint16_t type_max>
int remember(const nlattr* attribute, void* attributes) {
  if (mnl_attr_type_valid(attribute, type_max) < 0) return MNL_CB_OK;
  const nlattr*& place = static_cast<Attributes<type_max>*>(attributes)->of[mnl_attr_get_type(attribute)];
  if (place == nullptr) place = attribute;
  return MNL_CB_OK;
}

/// The attributes inside `outer`: none if that is null, and none behind one of an impossible length.
template <std::uint16_t type_max>
Attributes<type_max> nested_in(const nlattr* outer) {
  Attributes<type_max> found;
  if (outer != nullptr) mnl_attr_parse_nested(outer, remember<type_max>, &found);
  return found;
}

bool is_can(const nlattr* kind) {
  if (kind == nullptr) return false;
  const std::string_view text(static_cast<const char*>(mnl_attr_get_payload(kind)), mnl_attr_get_payload_len(kind));
  return text == "can" || text == std::string_view("can", sizeof "can");
}

ControllerState state_of(std::uint32_t raw) {
  switch (raw) {
    case CAN_STATE_ERROR_ACTIVE: return ControllerState::error_active;
    case CAN_STATE_ERROR_WARNING: return ControllerState::error_warning;
    case CAN_STATE_ERROR_PASSIVE: return ControllerState::error_passive;
    case CAN_STATE_BUS_OFF: return ControllerState::bus_off;
    case CAN_STATE_STOPPED: return ControllerState::stopped;
    case CAN_STATE_SLEEPING: return ControllerState::sleeping;
    default: return ControllerState::unknown;
  }
}

/// True if the attribute is missing, as a driver may leave it out, or complete.
template <class Value>
bool take(const nlattr* attribute, std::optional<Value>& out) {
  if (attribute == nullptr) return true;
  if (mnl_attr_validate2(attribute, MNL_TYPE_UNSPEC, sizeof(Value)) < 0) return false;
  std::memcpy(&out.emplace(), mnl_attr_get_payload(attribute), sizeof(Value));
  return true;
}

/// False: an attribute is damaged.
bool take_data(const nlattr* data, LinkDetails& out) {
  const auto in = nested_in<IFLA_CAN_MAX>(data).of;
  std::optional<can_bittiming> timing;
  std::optional<std::uint32_t> state;
  std::optional<std::uint32_t> restart_ms;
  std::optional<can_berr_counter> errors;
  const bool is_whole = take(in[IFLA_CAN_BITTIMING], timing) && take(in[IFLA_CAN_STATE], state) &&
                        take(in[IFLA_CAN_RESTART_MS], restart_ms) && take(in[IFLA_CAN_BERR_COUNTER], errors);
  if (!is_whole) return false;
  if (timing) out.bit_rate_bit_per_s = timing->bitrate;
  if (state) out.state = state_of(*state);
  if (restart_ms) out.restart_ms = *restart_ms;
  if (errors) out.errors = {.sending = errors->txerr, .receiving = errors->rxerr};
  return true;
}

bool take_history(const nlattr* statistics, LinkDetails& out) {
  std::optional<can_device_stats> counts;
  if (!take(statistics, counts)) return false;
  if (counts) {
    out.history = {.bus_errors = counts->bus_error,
                   .times_passive = counts->error_passive,
                   .times_bus_off = counts->bus_off,
                   .restarts = counts->restarts};
  }
  return true;
}

/// The RTM_NEWLINK of an answer: its position, and its fixed part.
struct Link {
  const nlmsghdr* message = nullptr;
  ifinfomsg info{};
};

/// An mnl_cb_t.
int remember_link(const nlmsghdr* message, void* link) {
  if (message->nlmsg_type != RTM_NEWLINK || mnl_nlmsg_get_payload_len(message) < sizeof(ifinfomsg)) {
    errno = EBADMSG;
    return MNL_CB_ERROR;
  }
  auto& out = *static_cast<Link*>(link);
  out.message = message;
  std::memcpy(&out.info, mnl_nlmsg_get_payload(message), sizeof(out.info));
  return MNL_CB_STOP;
}

/// 0 or a negative errno value: that of a refusal, or -EBADMSG.
int link_in(Bytes answer, Link& out) {
  if (mnl_cb_run(answer.data(), answer.size(), 0, 0, remember_link, &out) == MNL_CB_ERROR) return -errno;
  // Cut, an end without a link, or an acknowledgement.
  return out.message == nullptr ? -EBADMSG : 0;
}

/// Up to the end of the message: mnl_attr_parse() reads up to three bytes beyond one with an unaligned length.
Attributes<IFLA_MAX> attributes_of(const nlmsghdr& message) {
  Attributes<IFLA_MAX> found;
  mnl_attr_parse_payload(mnl_nlmsg_get_payload_offset(&message, sizeof(ifinfomsg)),
                         mnl_nlmsg_get_payload_len(&message) - sizeof(ifinfomsg), remember<IFLA_MAX>, &found);
  return found;
}

/// RTM_GETLINK: by an index, or by a name and the index 0.
class Request {
 public:
  explicit Request(int interface_index) : header_(mnl_nlmsg_put_header(room_.data())) {
    header_->nlmsg_type = RTM_GETLINK;
    header_->nlmsg_flags = NLM_F_REQUEST;
    auto* const link = static_cast<ifinfomsg*>(mnl_nlmsg_put_extra_header(header_, sizeof(ifinfomsg)));
    link->ifi_family = AF_UNSPEC;
    link->ifi_index = interface_index;
  }
  /// `name`: shorter than IFNAMSIZ.
  explicit Request(std::string_view name) : Request(0) { mnl_attr_put(header_, IFLA_IFNAME, name.size(), name.data()); }
  Request(const Request&) = delete;
  Request& operator=(const Request&) = delete;

  [[nodiscard]] Bytes bytes() const { return Bytes(room_).first(header_->nlmsg_len); }

 private:
  static constexpr std::size_t length_max = NLMSG_HDRLEN + NLMSG_ALIGN(sizeof(ifinfomsg)) + RTA_SPACE(IFNAMSIZ);

  alignas(nlmsghdr) std::array<std::byte, length_max> room_{};
  nlmsghdr* header_;
};

struct CloseSocket {
  void operator()(mnl_socket* socket) const { mnl_socket_close(socket); }
};

/// The answer of the kernel, in `room`; 0 or a negative errno value. It is there when the request has been sent; the
/// flag of the socket ensures that it is never waited for.
int query(const Request& request, AnswerRoom& room, Bytes& out) {
  const std::unique_ptr<mnl_socket, CloseSocket> socket(mnl_socket_open2(NETLINK_ROUTE, SOCK_CLOEXEC | SOCK_NONBLOCK));
  if (!socket || mnl_socket_sendto(socket.get(), request.bytes().data(), request.bytes().size()) < 0) return -errno;
  const ssize_t received = mnl_socket_recvfrom(socket.get(), room.bytes.data(), room.bytes.size());
  if (received < 0) return -errno;
  out = Bytes(room.bytes).first(static_cast<std::size_t>(received));
  return 0;
}

}  // namespace

std::string_view to_text(ControllerState state) {
  switch (state) {
    case ControllerState::unknown: return "unknown";
    case ControllerState::error_active: return "error-active";
    case ControllerState::error_warning: return "error-warning";
    case ControllerState::error_passive: return "error-passive";
    case ControllerState::bus_off: return "bus-off";
    case ControllerState::stopped: return "stopped";
    case ControllerState::sleeping: return "sleeping";
  }
  return "?";
}

int link_details_in(Bytes answer, LinkDetails& out) {
  out = {};
  Link link;
  if (const int result = link_in(answer, link); result < 0) return result;
  LinkDetails details{.is_up = (link.info.ifi_flags & IFF_UP) != 0};
  const auto info = nested_in<IFLA_INFO_MAX>(attributes_of(*link.message).of[IFLA_LINKINFO]).of;
  details.is_can = is_can(info[IFLA_INFO_KIND]);
  if (details.is_can && !(take_data(info[IFLA_INFO_DATA], details) && take_history(info[IFLA_INFO_XSTATS], details))) {
    return -EBADMSG;
  }
  out = details;
  return 0;
}

int bit_rate_in(Bytes answer, std::uint32_t& out_bit_per_s) {
  LinkDetails details;
  const int result = link_details_in(answer, details);
  out_bit_per_s = details.bit_rate_bit_per_s;
  return result;
}

int ask_bit_rate(int interface_index, std::uint32_t& out_bit_per_s) {
  LinkDetails details;
  const int result = ask_link_details(interface_index, details);
  out_bit_per_s = details.bit_rate_bit_per_s;
  return result;
}

int ask_link_details(int interface_index, LinkDetails& out) {
  out = {};
  AnswerRoom room;
  Bytes answer;
  const int result = query(Request(interface_index), room, answer);
  return result < 0 ? result : link_details_in(answer, out);
}

int found_link_in(Bytes answer, FoundLink& out) {
  out = {};
  Link link;
  if (const int result = link_in(answer, link); result < 0) return result;
  if (link.info.ifi_index <= 0) return -EBADMSG;
  constexpr unsigned running = IFF_UP | IFF_RUNNING;
  out = {.index = link.info.ifi_index, .is_running = (link.info.ifi_flags & running) == running};
  return 0;
}

int find_link(std::string_view name, FoundLink& out) {
  out = {};
  if (name.empty() || name.size() >= IFNAMSIZ) return -ENODEV;
  AnswerRoom room;
  Bytes answer;
  const int result = query(Request(name), room, answer);
  return result < 0 ? result : found_link_in(answer, out);
}

int look_again(std::string_view name, int index, FoundLink& out) {
  out = {};
  // A socket of any family serves for queries about interfaces.
  const OwnedFd socket(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (!socket.is_open()) return -errno;
  ifreq request{};
  request.ifr_ifindex = index;
  // For an index the kernel does not run modprobe, nor for the name of an existing interface.
  if (::ioctl(socket.get(), SIOCGIFNAME, &request) != 0) return -errno;
  const std::string_view found(request.ifr_name, ::strnlen(request.ifr_name, sizeof request.ifr_name));
  if (found != name) return -ENODEV;
  if (::ioctl(socket.get(), SIOCGIFFLAGS, &request) != 0) return -errno;
  out = {.index = index, .is_running = (static_cast<unsigned>(request.ifr_flags) & IFF_RUNNING) != 0};
  return 0;
}

}  // namespace bmu
