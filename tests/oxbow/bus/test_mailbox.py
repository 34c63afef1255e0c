from __future__ import annotations

import itertools
import sys
import threading

from oxbow.bus.mailbox import Mailbox


def test_items_are_delivered_in_order_and_none_is_left_behind() -> None:
    delivered: list[int] = []
    mailbox = Mailbox("test", delivered.append, size=100)
    assert all(mailbox.offer(i) for i in range(100))
    mailbox.close()
    assert delivered == list(range(100))
    assert not mailbox.offer(100)


def test_an_item_that_finds_no_room_is_refused_at_once() -> None:
    released = threading.Event()
    mailbox = Mailbox("test", lambda _item: released.wait(20.0), size=1)
    offered = [mailbox.offer(i) for i in range(4)]
    assert offered.count(False) >= 2
    released.set()
    mailbox.close()


def test_an_item_that_fails_costs_no_other() -> None:
    delivered: list[int] = []

    def deliver(item: int) -> None:
        delivered.append(10 // item)

    mailbox = Mailbox("test", deliver, size=10)
    for item in (5, 0, 2):
        mailbox.offer(item)
    mailbox.close()
    assert delivered == [2, 5]


def test_several_workers_share_the_items() -> None:
    meeting = threading.Barrier(3, timeout=20.0)
    mailbox = Mailbox("test", lambda _item: meeting.wait(), size=3, workers=3)
    for item in range(3):
        assert mailbox.offer(item)
    mailbox.close()
    assert not meeting.broken


def test_a_mailbox_may_be_closed_by_its_own_delivery() -> None:
    closed = threading.Event()

    def deliver(_item: int) -> None:
        mailbox.close()
        closed.set()

    mailbox = Mailbox("test", deliver, size=1)
    mailbox.offer(1)
    assert closed.wait(20.0)


def test_what_is_accepted_beside_the_close_is_delivered() -> None:
    interval_s = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        for _ in range(60):
            delivered: list[int] = []
            mailbox = Mailbox("test", delivered.append, size=10_000)
            accepted: list[int] = []

            def offer(mailbox: Mailbox[int] = mailbox, accepted: list[int] = accepted) -> None:
                accepted.extend(itertools.takewhile(mailbox.offer, range(10_000)))

            offering = [threading.Thread(target=offer) for _ in range(3)]
            for thread in offering:
                thread.start()
            mailbox.close()
            for thread in offering:
                thread.join()
            assert sorted(delivered) == sorted(accepted)
    finally:
        sys.setswitchinterval(interval_s)
