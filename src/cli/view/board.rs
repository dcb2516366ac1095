//! The latest message of each topic for pages. A slow page skips those in between.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use serde::Serialize;
use tungstenite::{Bytes, Message};

use super::exact::Field;
use rfm::view::{Plot, Setting};

/// The longest time after which a page that waits looks whether it is still wanted.
const LOOK: Duration = Duration::from_millis(500);

/// What is sent to a page, in the order in which it is sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Topic {
    Setting,
    Mesh,
    /// The mesh of bodies that are only moved. It is sent after the mesh of one instant, because a page that
    /// receives the latter forgets the former.
    Carried,
    Field,
    Slice,
    Frame,
    Plots,
    Status,
}

/// How many topics there are.
const TOPICS: usize = 8;

impl Topic {
    const ALL: [Self; TOPICS] = [
        Self::Setting,
        Self::Mesh,
        Self::Carried,
        Self::Field,
        Self::Slice,
        Self::Frame,
        Self::Plots,
        Self::Status,
    ];

    /// Whether the page says when it has taken such a message.
    pub fn is_answered(self) -> bool {
        matches!(self, Self::Mesh | Self::Carried | Self::Slice | Self::Frame)
    }
}

/// The state of the simulation, for a page.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(super) struct Status {
    pub playing: bool,
    pub speed: f64,
    /// What is going on, in a line.
    pub text: String,
    /// Messages about the file, as the command line shows them.
    pub error: Option<String>,
    /// How long the last change of a param took to become a mesh.
    pub latency: Option<String>,
}

#[derive(Default)]
struct News {
    setting: Option<Setting>,
    /// For each topic the newest message, with the number of messages of the topic so far.
    newest: [(u64, Option<Message>); TOPICS],
}

/// The latest of everything that is sent to pages.
#[derive(Default)]
pub(super) struct Board {
    news: Mutex<News>,
    changed: Condvar,
    /// How many pages are open.
    pages: AtomicUsize,
}

/// An open page.
pub(super) struct OpenPage<'a>(&'a Board);

impl Drop for OpenPage<'_> {
    fn drop(&mut self) {
        self.0.pages.fetch_sub(1, Ordering::Relaxed);
    }
}

/// What a page has been sent: for each topic the number of its newest message.
pub(super) type Sent = [u64; TOPICS];

impl Board {
    /// Counts a page as open until what is returned is dropped.
    pub fn open_page(&self) -> OpenPage<'_> {
        self.pages.fetch_add(1, Ordering::Relaxed);
        OpenPage(self)
    }

    /// Whether anybody looks.
    pub fn is_watched(&self) -> bool {
        self.pages.load(Ordering::Relaxed) > 0
    }

    /// What the page shows besides frames; `None` until the file has been read for the first time.
    pub fn setting(&self) -> Option<Setting> {
        self.lock().setting.clone()
    }

    pub fn set_setting(&self, setting: Setting) {
        let message = told("setting", &setting);
        self.lock().setting = Some(setting);
        self.put(Topic::Setting, message);
    }

    /// Sends the setting again, to pages whose fields have other values of params.
    pub fn repeat_setting(&self) {
        if let Some(setting) = self.setting() {
            self.set_setting(setting);
        }
    }

    pub fn set_status(&self, status: &Status) {
        self.put(Topic::Status, told("status", status));
    }

    pub fn set_field(&self, field: &Field) {
        self.put(Topic::Field, told("field", field));
    }

    pub fn set_plots(&self, plots: Vec<Plot>) {
        #[derive(Serialize)]
        struct Plots {
            plots: Vec<Plot>,
        }
        self.put(Topic::Plots, told("plots", &Plots { plots }));
    }

    /// Sets a mesh, a slice or a frame.
    pub fn set_block(&self, topic: Topic, block: Vec<u8>) {
        self.put(topic, Message::Binary(Bytes::from(block)));
    }

    /// Forgets what a page that comes later need not see.
    pub fn clear(&self, topic: Topic) {
        self.lock().newest[topic as usize].1 = None;
    }

    fn put(&self, topic: Topic, message: Message) {
        let mut news = self.lock();
        let place = &mut news.newest[topic as usize];
        *place = (place.0 + 1, Some(message));
        drop(news);
        self.changed.notify_all();
    }

    /// Wakes the pages that wait, so that they look at what has changed elsewhere.
    pub fn wake(&self) {
        drop(self.lock());
        self.changed.notify_all();
    }

    /// Waits for a message that has not been sent yet. `may_follow` says whether a topic may be sent now. `None` after
    /// some time without one.
    pub fn next(&self, sent: &mut Sent, may_follow: impl Fn(Topic) -> bool) -> Option<(Topic, Message)> {
        let find = |news: &News, sent: &Sent| {
            Topic::ALL.into_iter().find_map(|topic| {
                let (number, message) = &news.newest[topic as usize];
                let is_new = *number > sent[topic as usize] && may_follow(topic);
                message.clone().filter(|_| is_new).map(|message| (topic, *number, message))
            })
        };
        let news = self.lock();
        let waited = self.changed.wait_timeout_while(news, LOOK, |news| find(news, sent).is_none());
        let (news, _) = waited.unwrap_or_else(PoisonError::into_inner);
        let (topic, number, message) = find(&news, sent)?;
        sent[topic as usize] = number;
        Some((topic, message))
    }

    fn lock(&self) -> MutexGuard<'_, News> {
        // what is on the board is replaced as a whole, so a panic elsewhere has not left it half done
        self.news.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn told(kind: &'static str, content: &impl Serialize) -> Message {
    #[derive(Serialize)]
    struct Told<'a, T> {
        kind: &'static str,
        #[serde(flatten)]
        content: &'a T,
    }
    // numbers and texts: all of it has a form in JSON
    Message::text(serde_json::to_string(&Told { kind, content }).unwrap_or_default())
}
