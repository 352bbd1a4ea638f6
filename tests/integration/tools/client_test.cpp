// The client's side of the status socket; the daemon is only a listening socket.
#include "tools/bmuctl/client.hpp"

#include <algorithm>
#include <string>
#include <string_view>

#include <sys/socket.h>
#include <sys/un.h>

#include "tests/support/catch.hpp"
#include "tests/support/temporary_folder.hpp"

using namespace bmu;

namespace {

class Listener {
 public:
  explicit Listener(const std::string& path) : fd_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    REQUIRE(path.size() < sizeof(address.sun_path));
    std::copy(path.begin(), path.end(), address.sun_path);
    REQUIRE(::bind(fd_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0);
    REQUIRE(::listen(fd_.get(), 1) == 0);
  }
  [[nodiscard]] OwnedFd accept() const { return OwnedFd(::accept(fd_.get(), nullptr, nullptr)); }

 private:
  OwnedFd fd_;
};

/// A client with an accepted connection.
struct Connection {
  Connection() {
    REQUIRE(client);
    REQUIRE(daemon.is_open());
  }
  const TemporaryFolder folder;
  const Listener listener{(folder.path() / "bmud.sock").string()};
  Result<Client, std::string> client = Client::connect((folder.path() / "bmud.sock").string());
  OwnedFd daemon = listener.accept();
};

void say(const OwnedFd& daemon, std::string_view text) {
  REQUIRE(::send(daemon.get(), text.data(), text.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(text.size()));
}

}  // namespace

TEST_CASE("an answer that has arrived by the deadline is read behind the deadline", "[integration][daemon]") {
  Connection connection;
  // The deadline expires at once, as for a process that the machine has held up until then.
  const auto read_line = [&] { return connection.client->read_line(std::chrono::milliseconds{0}); };

  const auto nothing = read_line();
  REQUIRE_FALSE(nothing);
  CHECK(nothing.error() == "the daemon does not answer");
  say(connection.daemon, "{\"one\": 1}\n{\"two\"");
  const auto one = read_line();
  REQUIRE(one);
  CHECK(*one == "{\"one\": 1}");
  const auto half = read_line();
  REQUIRE_FALSE(half);
  CHECK(half.error() == "the daemon does not answer");
  say(connection.daemon, ": 2}\n");
  const auto two = read_line();
  REQUIRE(two);
  CHECK(*two == "{\"two\": 2}");
}

TEST_CASE("what a daemon says before it closes the connection is read first", "[integration][daemon]") {
  Connection connection;
  say(connection.daemon, "{\"last\": 1}\n");
  connection.daemon = OwnedFd();
  const auto last = connection.client->read_line(std::chrono::milliseconds{0});
  REQUIRE(last);
  CHECK(*last == "{\"last\": 1}");
  const auto gone = connection.client->read_line(std::chrono::milliseconds{0});
  REQUIRE_FALSE(gone);
  CHECK(gone.error() == "the daemon closed the connection");
}
