// SPDX-License-Identifier: Apache-2.0
// A web server for one page and one reader: on 127.0.0.1 only, and only for those who know its address, which holds a
// random token of 128 bits. It serves what a function answers, never files.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace covary {

struct LiveRequest {
  std::string method;  ///< "GET" or "POST"
  std::string path;    ///< behind the token: "" for the page, "state", "image/mean"
  std::string body;    ///< at most 64 KiB
};

struct LiveAnswer {
  int status = 404;
  std::string type = "text/plain";
  std::shared_ptr<const std::vector<char>> body;

  static LiveAnswer text(int status, const std::string& type, const std::string& body);
};

class LiveServer {
 public:
  /// Called in the server's thread, for one request at a time.
  using Handler = std::function<LiveAnswer(const LiveRequest&)>;

  /// `port` 0: any free one. Throws Error(kIo) if the port cannot be had.
  ///
  /// Answered by 403, without calling `answer`: addresses without the token; a Host other than 127.0.0.1 or localhost,
  /// as other sites have that let their name lead here; and an Origin other than the page's own.
  LiveServer(int port, Handler answer);
  ~LiveServer();
  LiveServer(const LiveServer&) = delete;
  LiveServer& operator=(const LiveServer&) = delete;

  /// "http://127.0.0.1:PORT/TOKEN/"
  const std::string& address() const;
  int port() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace covary
