"""What tests share: scenes, requests, Mission Files, and processes to be started."""
