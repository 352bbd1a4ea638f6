// LinkSystem of the kernel: reads by rtnetlink (link_details.hpp), sets up by libsocketcan.
#include <cerrno>
#include <string>

#include <libsocketcan.h>
#include <linux/capability.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "daemon/shell/can/link_watch.hpp"

namespace bmu {

namespace {

/// As the kernel reports it: root may have lost the capability, and others may have been given it.
bool may_change_links() {
  __user_cap_header_struct header{.version = _LINUX_CAPABILITY_VERSION_3, .pid = 0};
  __user_cap_data_struct data[_LINUX_CAPABILITY_U32S_3]{};
  if (::syscall(SYS_capget, &header, static_cast<__user_cap_data_struct*>(data)) != 0) return false;
  return (data[CAP_TO_INDEX(CAP_NET_ADMIN)].effective & CAP_TO_MASK(CAP_NET_ADMIN)) != 0;
}

/// The library reports a failure by -1, and the reason by errno, if at all.
int checked(int result) {
  if (result >= 0) return 0;
  return errno == 0 ? -EIO : -errno;
}

class KernelLinkSystem final : public LinkSystem {
 public:
  LinkLook look(const std::string& interface_name) override {
    FoundLink found;
    if (const int result = find_link(interface_name, found); result < 0) return {.result = result};
    LinkLook look{.has_right = may_change_links()};
    look.result = ask_link_details(found.index, look.details);
    return look;
  }

  LinkTried set_up(const std::string& interface_name, const LinkSettings& settings) override {
    const char* const name = interface_name.c_str();
    LinkTried tried;
    errno = 0;
    tried.result = checked(::can_set_bitrate(name, settings.bit_rate_bit_per_s));
    if (tried.result < 0) return tried;
    // Some drivers have no restart, which is no reason to have no bus.
    tried.has_restart = ::can_set_restart_ms(name, settings.restart_ms) == 0 || settings.restart_ms == 0;
    errno = 0;
    tried.result = checked(::can_do_start(name));
    return tried;
  }
};

}  // namespace

LinkSystem& kernel_link_system() {
  static KernelLinkSystem system;
  return system;
}

}  // namespace bmu
