// Requests that the server of a local page accepts and refuses, sent over plain sockets.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>
#include <atomic>

#include "base/error.h"
#include "replay/view/loopback_server.h"
#include "tests/support/tests.h"

namespace tessera::replay::loopback_server_test {
namespace {

using testing::StartsWith;

// A connection to 127.0.0.1.
class Client {
 public:
  explicit Client(int port, int receive_bytes = 0) : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    if (receive_bytes > 0) setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_bytes, sizeof receive_bytes);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    connected_ = connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  }
  ~Client() { close(socket_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  bool connected() const { return connected_; }
  // False once the other side has closed.
  bool write(std::string_view bytes) const {
    while (!bytes.empty()) {
      const ssize_t count = send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (count <= 0) return false;
      bytes.remove_prefix(static_cast<std::size_t>(count));
    }
    return true;
  }
  // Until `end` is in it, the other side closes or nothing comes for so long.
  std::string read(const std::string& end = "", int milliseconds = 10000) const {
    std::string text;
    for (pollfd ready{socket_, POLLIN, 0}; poll(&ready, 1, milliseconds) > 0;) {
      char buffer[65536];
      const ssize_t count = recv(socket_, buffer, sizeof buffer, 0);
      if (count <= 0) break;
      text.append(buffer, static_cast<std::size_t>(count));
      if (!end.empty() && text.find(end) != std::string::npos) break;
    }
    return text;
  }

 private:
  int socket_;
  bool connected_ = false;
};

class Loopback : public testing::Test {
 protected:
  std::atomic<int> calls_ = 0;
  std::string body_;  // of the last request
  LoopbackServer server_{0, "events", [this](const HttpRequest& request) {
                           ++calls_;
                           body_ = request.body;
                           if (request.path == "throw") throw std::runtime_error("what broke");
                           if (request.path.empty() || request.path == "set") return http_reply(200, "the page\n");
                           return http_reply(404, "not found\n");
                         }};

  std::string host() const { return fmt::format("127.0.0.1:{}", server_.port()); }
  std::string root() const { return "/" + server_.token() + "/"; }
  std::string ask(const std::string& target, const std::string& headers, const std::string& method = "GET",
                  const std::string& body = "") const {
    const Client client(server_.port());
    client.write(fmt::format("{} {} HTTP/1.1\r\n{}Connection: close\r\n\r\n{}", method, target, headers, body));
    return client.read();
  }
  std::string get(const std::string& target) const { return ask(target, "Host: " + host() + "\r\n"); }
  std::string post(const std::string& body, const std::string& headers) const {
    return ask(root() + "set", "Host: " + host() + "\r\n" + headers, "POST", body);
  }
};

constexpr const char* kJson = "Content-Type: application/json\r\n";
std::string length_of(std::size_t bytes) { return fmt::format("Content-Length: {}\r\n", bytes); }

TEST_F(Loopback, ThePageIsThereForWhoKnowsItsAddress) {
  EXPECT_EQ(server_.url(), "http://" + host() + root());
  const std::string reply = get(root());
  EXPECT_THAT(reply, StartsWith("HTTP/1.1 200 "));
  EXPECT_THAT(reply, HasSubstr("\r\n\r\nthe page\n"));
  for (const char* header :
       {"Content-Security-Policy: default-src 'none'; frame-ancestors 'none'", "Cache-Control: no-store",
        "Cross-Origin-Resource-Policy: same-origin", "Referrer-Policy: no-referrer", "X-Content-Type-Options: nosniff"})
    EXPECT_THAT(reply, HasSubstr(std::string("\r\n") + header + "\r\n"));
  EXPECT_THAT(reply, testing::Not(HasSubstr("Access-Control")));
  EXPECT_THAT(ask(root(), fmt::format("Host: localhost:{}\r\n", server_.port())), StartsWith("HTTP/1.1 200 "));
}

// LS1. Sockets that listen on this port, as the kernel lists them.
TEST_F(Loopback, LS1ListensOnTheLoopbackAddressAlone) {
  std::vector<std::string> addresses;
  for (const char* table : {"/proc/net/tcp", "/proc/net/tcp6"}) {
    std::istringstream lines(test::read_text(table));
    std::string line;
    std::getline(lines, line);
    while (std::getline(lines, line)) {
      std::istringstream words(line);
      std::string number, local, remote, state;
      words >> number >> local >> remote >> state;
      const std::size_t colon = local.find(':');
      if (state == "0A" && std::stoi(local.substr(colon + 1), nullptr, 16) == server_.port())
        addresses.push_back(local.substr(0, colon));
    }
  }
  EXPECT_THAT(addresses, testing::ElementsAre("0100007F"));
}

TEST_F(Loopback, LS2AnotherHostIsRefused) {
  for (const std::string& name :
       {std::string("evil.example"), fmt::format("evil.example:{}", server_.port()), std::string("127.0.0.1"),
        fmt::format("127.0.0.1:{}", server_.port() - 1), fmt::format("127.0.0.2:{}", server_.port()),
        fmt::format("127.0.0.1:{}.evil.example", server_.port()), fmt::format("[::1]:{}", server_.port()),
        std::string()}) {
    const std::string reply = ask(root(), "Host: " + name + "\r\n");
    EXPECT_THAT(reply, StartsWith("HTTP/1.1 421 ")) << name;
    EXPECT_THAT(reply, testing::Not(HasSubstr("the page"))) << name;
    // Nor does it learn whether a token is right.
    EXPECT_THAT(ask("/nothing", "Host: " + name + "\r\n"), StartsWith("HTTP/1.1 421 ")) << name;
  }
  EXPECT_THAT(ask(root(), "Host: " + host() + "\r\nHost: evil.example\r\n"), testing::Not(HasSubstr("the page")));
  EXPECT_THAT(ask(root(), ""), testing::Not(HasSubstr("the page"))) << "none at all";
  EXPECT_EQ(calls_, 0);
}

TEST_F(Loopback, LS2AnotherOriginIsRefused) {
  const std::string own = "Host: " + host() + "\r\n";
  EXPECT_THAT(ask(root(), own + "Origin: http://" + host() + "\r\n"), StartsWith("HTTP/1.1 200 "));
  calls_ = 0;
  for (const std::string& origin : {std::string("http://evil.example"), std::string("null"), "https://" + host(),
                                    "http://" + host() + ".evil.example", std::string("http://127.0.0.1")})
    EXPECT_THAT(ask(root(), own + "Origin: " + origin + "\r\n"), StartsWith("HTTP/1.1 403 ")) << origin;
  EXPECT_EQ(calls_, 0);
}

TEST_F(Loopback, LS3AnotherTokenIs404WhicheverDigitDiffers) {
  EXPECT_EQ(server_.token().size(), 32u);
  EXPECT_EQ(server_.token().find_first_not_of("0123456789abcdef"), std::string::npos);
  for (std::size_t digit = 0; digit < server_.token().size(); ++digit) {
    std::string token = server_.token();
    token[digit] = token[digit] == '0' ? '1' : '0';
    EXPECT_THAT(get("/" + token + "/"), StartsWith("HTTP/1.1 404 ")) << digit;
  }
  const std::string token = server_.token();
  for (const std::string& target :
       {std::string("/"), "/" + token, "/" + token.substr(1) + "/", "/" + token + "0/", "//" + token + "/",
        "/x/" + token + "/", std::string("/favicon.ico"), std::string("/set"), std::string("/events"), token + "/",
        "/%" + fmt::format("{:02x}", static_cast<unsigned>(token[0])) + token.substr(1) + "/"})
    EXPECT_THAT(get(target), testing::AnyOf(StartsWith("HTTP/1.1 404 "), StartsWith("HTTP/1.1 400 "))) << target;
  EXPECT_EQ(calls_, 0);
  const LoopbackServer other(0, "events", [](const HttpRequest&) { return http_reply(200, ""); });
  EXPECT_NE(other.token(), token);
}

TEST_F(Loopback, LS3NoPathIsOneOfTheFileSystem) {
  for (const char* path :
       {"../../etc/passwd", "..%2f..%2fetc%2fpasswd", "%2e%2e/%2e%2e/etc/passwd", "....//etc/passwd", "/etc/passwd",
        "image/../../../etc/passwd", "image/..%5c..%5cetc%5cpasswd", "./", "set/", "set%00", "%00", "index.html"}) {
    const std::string reply = get(root() + path);
    EXPECT_THAT(reply, StartsWith("HTTP/1.1 404 ")) << path;
    EXPECT_THAT(reply, testing::Not(HasSubstr("root:"))) << path;
  }
  EXPECT_THAT(get("http://" + host() + root()), testing::Not(HasSubstr("the page"))) << "a proxy's form";
}

TEST_F(Loopback, LS4ABodyThatIsTooLargeIsNotKept) {
  constexpr std::size_t kMost = LoopbackServer::kMaxBody;
  EXPECT_THAT(post(std::string(kMost, 'a'), kJson + length_of(kMost)), StartsWith("HTTP/1.1 200 "));
  EXPECT_EQ(body_.size(), kMost);
  calls_ = 0;
  for (const std::size_t bytes : {kMost + 1, std::size_t{1} << 20, std::size_t{1} << 62})
    EXPECT_THAT(post("", kJson + length_of(bytes)), StartsWith("HTTP/1.1 413 ")) << bytes;
  // In chunks, which say no length before: the connection ends, whatever else would come.
  const Client client(server_.port());
  client.write("POST " + root() + "set HTTP/1.1\r\nHost: " + host() + "\r\n" + kJson +
               "Transfer-Encoding: chunked\r\n\r\n");
  const std::string chunk = "4000\r\n" + std::string(0x4000, 'a') + "\r\n";
  int chunks = 0;
  while (chunks < 4096 && client.write(chunk)) ++chunks;
  EXPECT_LT(chunks, 4096);
  EXPECT_EQ(calls_, 0);
}

TEST_F(Loopback, LS4AHeadThatIsTooLargeEndsItsConnectionAlone) {
  const Client client(server_.port());
  client.write("GET " + root() + " HTTP/1.1\r\nX: ");
  const std::string much(1 << 16, 'a');
  int pieces = 0;
  while (pieces < 1024 && client.write(much)) ++pieces;
  EXPECT_LT(pieces, 1024);
  EXPECT_EQ(calls_, 0);
  EXPECT_THAT(get(root()), StartsWith("HTTP/1.1 200 "));
}

TEST_F(Loopback, LS4OnlyJsonIsPosted) {
  for (const char* type : {"", "Content-Type: text/plain\r\n", "Content-Type: application/x-www-form-urlencoded\r\n",
                           "Content-Type: multipart/form-data; boundary=x\r\n"})
    EXPECT_THAT(post("{}", type + length_of(2)), StartsWith("HTTP/1.1 415 ")) << type;
  for (const char* method : {"PUT", "DELETE", "OPTIONS", "PATCH", "TRACE", "CONNECT", "NONSENSE"})
    EXPECT_THAT(ask(root(), "Host: " + host() + "\r\n", method), testing::Not(StartsWith("HTTP/1.1 2"))) << method;
  EXPECT_EQ(calls_, 0);
  EXPECT_THAT(post("{}", "Content-Type: application/json; charset=utf-8\r\n" + length_of(2)),
              StartsWith("HTTP/1.1 200 "));
}

TEST_F(Loopback, AnExceptionOfAHandlerIsStatus500) {
  const std::string reply = get(root() + "throw");
  EXPECT_THAT(reply, StartsWith("HTTP/1.1 500 "));
  EXPECT_THAT(reply, HasSubstr("what broke"));
  EXPECT_THAT(get(root()), StartsWith("HTTP/1.1 200 "));
}

TEST_F(Loopback, NonsenseEndsNoServer) {
  for (const std::string& bytes :
       {std::string("\0\0\0\0", 4), std::string("\r\n\r\n\r\n"), std::string("GET"), std::string(1000, '\xff'),
        std::string("GET / HTTP/9.9\r\n\r\n"), std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xfc", 9),
        "GET " + root() + " HTTP/1.1\r\nHost: " + host() + "\r\nContent-Length: -1\r\n\r\n",
        "POST " + root() + "set HTTP/1.1\r\nHost: " + host() + "\r\n" + kJson +
            "Transfer-Encoding: chunked\r\n\r\nzz\r\n"}) {
    const Client client(server_.port());
    client.write(bytes);
    client.read("", 50);
  }
  calls_ = 0;
  EXPECT_THAT(get(root()), StartsWith("HTTP/1.1 200 "));
  EXPECT_EQ(calls_, 1);
}

TEST_F(Loopback, EventsComeAsTheyAreSentAndTheNewestToWhoComesLater) {
  server_.send("result", "1");
  server_.send("state", "2");
  server_.send("result", "3");
  const Client client(server_.port());
  client.write("GET " + root() + "events HTTP/1.1\r\nHost: " + host() + "\r\n\r\n");
  const std::string begin = client.read("data: 3\n\n");
  EXPECT_THAT(begin, StartsWith("HTTP/1.1 200 "));
  EXPECT_THAT(begin, HasSubstr("Content-Type: text/event-stream"));
  EXPECT_THAT(begin, HasSubstr("event: state\ndata: 2\n\n"));
  EXPECT_THAT(begin, testing::Not(HasSubstr("data: 1\n")));
  server_.send("state", "4");
  EXPECT_THAT(client.read("data: 4\n\n"), HasSubstr("event: state\ndata: 4\n\n"));
  server_.send("", "");
  EXPECT_THAT(client.read(":\n\n"), HasSubstr(":\n\n"));
  EXPECT_EQ(calls_, 0);
}

TEST_F(Loopback, LS5AReaderThatIsSlowGetsTheNewestAndNothingQueuesUp) {
  const Client client(server_.port(), 4096);
  client.write("GET " + root() + "events HTTP/1.1\r\nHost: " + host() + "\r\n\r\n");
  const std::string much(256 << 10, 'a');
  constexpr int kSent = 400;  // 100 MiB
  for (int k = 0; k < kSent; ++k) server_.send("result", fmt::format("{}-{}-end", much, k));
  const std::string text = client.read(fmt::format("-{}-end", kSent - 1));
  EXPECT_THAT(text, testing::EndsWith("\r\n")) << "of a chunk";
  EXPECT_NE(text.find(fmt::format("-{}-end", kSent - 1)), std::string::npos);
  EXPECT_LT(text.size(), std::size_t{40} << 20);
}

TEST_F(Loopback, StreamsComeAndGoWhileEventsAreSent) {
  std::atomic<bool> done = false;
  std::vector<std::thread> senders;
  for (const char* name : {"result", "state"})
    senders.emplace_back([&, name] {
      for (int k = 0; !done; ++k) server_.send(name, std::to_string(k));
    });
  for (int k = 0; k < 100; ++k) {
    const Client client(server_.port());
    client.write("GET " + root() + "events HTTP/1.1\r\nHost: " + host() + "\r\n\r\n");
    EXPECT_THAT(client.read("data: "), HasSubstr("event: ")) << k;
  }
  done = true;
  for (std::thread& sender : senders) sender.join();
  EXPECT_THAT(get(root()), StartsWith("HTTP/1.1 200 "));
}

TEST_F(Loopback, LS6EndsWhateverClientsDo) {
  const Client listens(server_.port()), is_slow(server_.port(), 4096), hesitates(server_.port()),
      silent(server_.port());
  for (const Client* client : {&listens, &is_slow})
    client->write("GET " + root() + "events HTTP/1.1\r\nHost: " + host() + "\r\n\r\n");
  server_.send("result", "1");
  listens.read("data: 1");
  server_.send("state", std::string(8 << 20, 'a'));
  hesitates.write("POST " + root() + "set HTTP/1.1\r\nHost: " + host() + "\r\n" + kJson + length_of(100) + "\r\n{");
  server_.close();
  EXPECT_FALSE(Client(server_.port()).connected());
  silent.read();  // ends: the other side has closed
}

TEST_F(Loopback, APortThatIsTakenIsSaid) {
  try {
    const LoopbackServer second(server_.port(), "events", [](const HttpRequest&) { return http_reply(200, ""); });
    FAIL() << "two listen on one port";
  } catch (const UsageError& error) {
    EXPECT_THAT(error.what(), HasSubstr(fmt::format("--port {}: Address already in use", server_.port())));
  }
}

}  // namespace
}  // namespace tessera::replay::loopback_server_test
