//! Drives a headless Chromium over its DevTools protocol, through its pipe: JSON, each message ended by a zero byte.

use std::io::{BufRead, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use serde_json::{Value, json};
use tempfile::TempDir;

/// Names of this browser's programs, the smallest first.
const PROGRAMS: [&str; 3] = ["chromium-headless-shell", "chromium", "google-chrome"];

/// Returns the first of them that is installed.
fn program() -> &'static str {
    let starts = |program: &&str| {
        let mut version = Command::new(program);
        version
            .arg("--version")
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        version.status().is_ok_and(|status| status.success())
    };
    let first = PROGRAMS.into_iter().find(starts);
    first.unwrap_or_else(|| panic!("none of {PROGRAMS:?} is installed: cargo verify does it"))
}

/// A running browser with one open page.
pub struct Browser {
    child: Child,
    to: ChildStdin,
    from: BufReader<ChildStdout>,
    session: String,
    last_id: u64,
    /// Events reported by the browser, in order.
    pub events: Vec<Value>,
    /// Folder of its profile and of saved files.
    folder: TempDir,
}

impl Browser {
    /// Starts it with an empty page of `width` by 900 pixels.
    pub fn start(width: u32) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        // The protocol's pipe is on descriptors 3 and 4, to which a shell can redirect the usual two.
        let mut child = Command::new("sh")
            .args(["-c", "exec \"$0\" \"$@\" 3<&0 4>&1 1>&2", program()])
            .args([
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--remote-debugging-pipe",
            ])
            .args(["--no-first-run", "--disable-dev-shm-usage"])
            .arg(format!("--user-data-dir={}", folder.path().display()))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("a shell");
        let mut browser = Self {
            to: child.stdin.take().expect("a pipe"),
            from: BufReader::new(child.stdout.take().expect("a pipe")),
            child,
            session: String::new(),
            last_id: 0,
            events: Vec::new(),
            folder,
        };
        let target = browser.call("Target.createTarget", json!({ "url": "about:blank" }));
        let target = json!({ "targetId": target["targetId"], "flatten": true });
        let attached = browser.call("Target.attachToTarget", target);
        browser.session = attached["sessionId"]
            .as_str()
            .expect("a session")
            .to_owned();
        let saved = json!({ "behavior": "allow", "downloadPath": browser.folder.path() });
        browser.call("Browser.setDownloadBehavior", saved);
        for domain in ["Page.enable", "Runtime.enable", "Log.enable"] {
            browser.call(domain, json!({}));
        }
        browser.resize(width);
        browser
    }

    /// Returns the folder of saved files.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Calls a method of the protocol and returns its result.
    pub fn call(&mut self, method: &str, params: Value) -> Value {
        self.last_id += 1;
        let mut message = json!({ "id": self.last_id, "method": method, "params": params });
        if !self.session.is_empty() && !method.starts_with("Browser.") {
            message["sessionId"] = json!(self.session);
        }
        let sent = self.to.write_all(format!("{message}\0").as_bytes());
        sent.unwrap_or_else(|error| panic!("the browser does not listen: {error}"));
        loop {
            let answer = self.read();
            if answer["id"] == json!(self.last_id) {
                assert!(answer["error"].is_null(), "{method}: {}", answer["error"]);
                return answer["result"].clone();
            }
            self.events.push(answer);
        }
    }

    fn read(&mut self) -> Value {
        let mut message = Vec::new();
        let count = self.from.read_until(0, &mut message).expect("a pipe");
        assert!(count > 1, "the browser went away");
        serde_json::from_slice(&message[..count - 1]).expect("JSON")
    }

    /// Makes the page `width` by 900 pixels.
    pub fn resize(&mut self, width: u32) {
        let size =
            json!({ "width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 600 });
        self.call("Emulation.setDeviceMetricsOverride", size);
    }

    /// Opens a file and waits until it is loaded.
    pub fn open(&mut self, page: &Path) {
        self.events.clear();
        let url = format!("file://{}", page.display());
        self.call("Page.navigate", json!({ "url": url }));
        let is_loaded = |event: &Value| event["method"] == json!("Page.loadEventFired");
        while !self.events.iter().any(is_loaded) {
            let event = self.read();
            self.events.push(event);
        }
    }

    /// Returns the value of a JavaScript expression, as JSON.
    pub fn value(&mut self, expression: &str) -> Value {
        let wanted =
            json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let answer = self.call("Runtime.evaluate", wanted);
        assert!(
            answer["exceptionDetails"].is_null(),
            "{expression}: {answer}"
        );
        answer["result"]["value"].clone()
    }

    /// Presses the left button at one place, moves to the other, lets go; `count` presses are a click or a double one.
    pub fn drag(&mut self, from: (f64, f64), to: (f64, f64), count: u32, modifiers: u32) {
        for (kind, (x, y)) in [
            ("mouseMoved", from),
            ("mousePressed", from),
            ("mouseMoved", ((from.0 + to.0) / 2.0, to.1)),
            ("mouseMoved", to),
            ("mouseReleased", to),
        ] {
            let held = !matches!(kind, "mouseReleased");
            let event = json!({
                "type": kind, "x": x, "y": y, "modifiers": modifiers, "clickCount": count,
                "button": "left", "buttons": u32::from(held),
            });
            self.call("Input.dispatchMouseEvent", event);
        }
    }

    /// Returns all warnings and errors of the page since it was opened.
    pub fn complaints(&self) -> Vec<String> {
        let is_bad = |event: &&Value| match event["method"].as_str() {
            Some("Runtime.exceptionThrown") => true,
            Some("Runtime.consoleAPICalled") => {
                matches!(
                    event["params"]["type"].as_str(),
                    Some("error" | "warning" | "assert")
                )
            }
            Some("Log.entryAdded") => {
                matches!(
                    event["params"]["entry"]["level"].as_str(),
                    Some("error" | "warning")
                )
            }
            _ => false,
        };
        self.events
            .iter()
            .filter(is_bad)
            .map(Value::to_string)
            .collect()
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
