//! Views of volumes as texts.

use super::*;
use crate::volume::VolumeBox;
use crate::volume_scene::{ChannelFacts, VolumePane};

fn facts() -> VolumeFacts {
    VolumeFacts {
        name: "cells".into(),
        of: VolumeBox::new([40, 30, 20], [0.25, 0.25, 1.0]),
        origin: [0.0; 3],
        unit_length: 1.0,
        unit: None,
        channels: vec![ChannelFacts::default(); 3],
        labels: vec!["nuclei".into(), "a:b %;c".into(), "off".into()],
        label_bounds: vec![[0, 255], [-128, 127], [0, 255]],
        times: 5,
        base: 0.0,
        gain: 255.0,
        bounds: Some([0.0, 255.0]),
        downsample: None,
        made_by: None,
        brick: 64,
        levels: None,
    }
}

#[test]
fn all_that_is_shown_comes_back() {
    let facts = facts();
    let first = VolumeLook::first(&facts);
    let mut look = first.clone();
    look.channels[0].is_shown = false;
    look.channels[1].range = Some([-0.1, 1e-7]);
    (look.channels[1].gamma, look.channels[1].opacity) = (0.3, 0.25);
    look.channels[2].map = Some(Palette::TURBO.reversed());
    look.channels[2].color = [1, 2, 254];
    look.labels = LabelsLook {
        shown: Some(1),
        opacity: 0.7,
        outlines: true,
        selected: Some(-9),
        others: OtherLabels::Hidden,
    };
    (look.mode, look.iso, look.step, look.density) = (VolumeMode::Iso, Some(0.1 + 0.2), 1.0 / 3.0, 7.5);
    (look.time, look.zoom) = (4, 3.5);
    look.put_cross(&facts.of, DVec3::new(1.0, 2.0, 3.0));
    look.centre = DVec3::new(0.1, 0.7, 1.3);
    (look.orbit.yaw, look.orbit.pitch, look.orbit.zoom) = (-12.3, 91.0, 0.3);
    look.orbit.target = DVec3::new(-1.0, 1.0, 0.5);
    look.layout = VolumeLayout::One(VolumePane::Y);
    look.clip.shares = [[0.0, 0.5], [0.1, 0.9], [0.0, 1.0]];
    (look.clip.has_plane, look.clip.plane_yaw, look.clip.plane_depth) = (true, 12.5, 0.3);
    // Nothing of the channels; nothing but labels, which are called as none are.
    let mut none = first.clone();
    none.channels.iter_mut().for_each(|channel| channel.is_shown = false);
    let mut labels = none.clone();
    labels.labels = LabelsLook { shown: Some(2), ..LabelsLook::default() };
    labels.clip.shares[1] = [0.5, 1.0];
    let mut tilted = first.clone();
    tilted.tilt_by(VolumePane::Z, 30.0, -12.5);
    tilted.tilt_by(VolumePane::X, 0.0, 7.0);
    tilted.put_cross(&facts.of, DVec3::new(4.0, 2.125, 3.5));
    let mut equal = first.clone();
    equal.channels[1].range = Some([5.0, 5.0]);
    for look in [look, first.clone(), none, labels, tilted, equal] {
        let text = VolumeViewText::of(&look, &facts).to_string();
        assert!(VolumeViewText::is_meant(&text) && !text.contains(char::is_whitespace), "{text}");
        let view: VolumeViewText = text.parse().unwrap();
        assert_eq!(view.to_string(), text);
        let mut shown = first.clone();
        view.change(&mut shown, &facts).unwrap();
        // What is hidden keeps what it had, and numbers came through voxels.
        shown.orbit.target = look.orbit.target;
        shown.centre = look.centre;
        assert_eq!(shown, look, "{text}");
        // And over anything else.
        let mut other = first.clone();
        other.clip.shares[2] = [0.5, 0.75];
        (other.step, other.density) = (0.2, 3.0);
        (other.clip.has_plane, other.clip.plane_depth) = (true, 0.25);
        other.tilt_by(VolumePane::Y, 5.0, 5.0);
        view.change(&mut other, &facts).unwrap();
        (other.orbit.target, other.centre) = (look.orbit.target, look.centre);
        assert_eq!(other, look, "{text}");
    }
}

#[test]
fn what_is_said_nothing_of_stays() {
    let facts = facts();
    let mut look = VolumeLook::first(&facts);
    (look.mode, look.time) = (VolumeMode::Average, 3);
    look.clip.shares[1] = [0.0, 0.5];
    let before = look.clone();
    let view: VolumeViewText = "volume:x=20,y=15,z=10,zoom=2,yaw=0,pitch=90".parse().unwrap();
    view.change(&mut look, &facts).unwrap();
    assert_eq!(
        (look.orbit.zoom, look.orbit.pitch, look.orbit.target),
        (2.0, 90.0, DVec3::new(5.0, 3.75, 10.0))
    );
    assert_eq!(VolumeLook { orbit: before.orbit, ..look }, before);
}

#[test]
fn what_is_no_view_is_told_why() {
    let camera = "volume:x=1,y=2,z=3,zoom=1,yaw=0,pitch=0";
    for (text, why) in [
        ("volume:", "write volume:x=.."),
        ("image:x=1,y=2,zoom=3", "write volume:x=.."),
        ("volume:x=1,y=2,z=3,zoom=1,yaw=0", "something is missing"),
        ("volume:x=1,x=1,y=2,z=3,zoom=1,yaw=0,pitch=0", "'x=1'"),
        ("volume:x=nan,y=2,z=3,zoom=1,yaw=0,pitch=0", "'x=nan'"),
        ("volume:x=1,y=2,z=3,zoom=0,yaw=0,pitch=0", "greater than 0"),
        (";mode=mop", "mip, minip"),
        (";mode=mip;mode=mip", "told twice"),
        (";moon=1", "there is no 'moon'"),
        (";panes=5", "four, x, y, z and 3d"),
        (";slices=1,2", "three numbers"),
        (";slices=1,2,-3", "from 0"),
        (";slices=1,2,3:at=4", "middle"),
        (";slices=1,2,3:place=4", "three numbers"),
        (";tilt=w:1,2", "x, y or z"),
        (";tilt=z", "x, y or z"),
        (";tilt=z:1", "x, y or z"),
        (";tilt=z:90,0", "-89 to 89"),
        (";tilt=z:1,0:z:2,0", "told twice"),
        (";channel=a", "comes first"),
        (";channel=0:color=red", "RRGGBB"),
        (";channel=0:map=jet", "viridis"),
        (";channel=0:range=inf..1", "no number"),
        (";channel=0:gamma=0", "0.01"),
        (";channel=0;channel=0", "told twice"),
        (";labels=:opacity=1", "comes first"),
        (";labels=a:selected=0", "no label"),
        (";channels=all", "channels=none"),
        (";channels=none;channel=0", "none"),
        (";channel=0;channels=none", "named beside it"),
        (";labels=a:others=gone", "dimmed or hidden"),
        (";clip=0..1,0..1", "shares"),
        (";clip=0..1,0..1,1..0", "shares"),
        (";clip=0..1,0..1,0..1,0..1", "shares"),
        (";plane=1,2,3", "depth"),
        (";time=-1", "whole number"),
        (";step=0", "0.01"),
    ] {
        let text = if text.starts_with(';') { format!("{camera}{text}") } else { text.to_owned() };
        let error = text.parse::<VolumeViewText>().unwrap_err().to_string();
        assert!(error.contains(why), "{text}: {error}");
    }
    let many: String = (0..17).map(|nth| format!(";channel={nth}")).collect();
    assert!(format!("{camera}{many}").parse::<VolumeViewText>().is_err());
    // What the volume does not have.
    let facts = facts();
    for (part, why) in [
        ("channel=3", "channels 0 to 2"),
        ("time=5", "times 0 to 4"),
        ("labels=x", "nuclei"),
        ("labels=nuclei:selected=300", "nuclei has no label 300: its values are 0 to 255"),
        ("labels=nuclei:selected=-1", "has no label -1"),
    ] {
        let view: VolumeViewText = format!("{camera};mode=iso;{part}").parse().unwrap();
        let mut look = VolumeLook::first(&facts);
        let error = view.change(&mut look, &facts).unwrap_err().to_string();
        assert!(error.contains(why) && look == VolumeLook::first(&facts), "{part}: {error}");
    }
}

#[test]
fn a_text_of_labels_by_themselves_brings_back_all_of_it() {
    let facts = VolumeFacts { channels: Vec::new(), labels: vec!["nuclei".into()], ..facts() };
    let first = VolumeLook::first(&facts);
    let text = VolumeViewText::of(&first, &facts).to_string();
    assert!(text.contains("channels=none;labels=nuclei:opacity=1"), "{text}");
    // Also one that says nothing of the channels that there are not.
    for text in [text.clone(), text.replace(";channels=none", "")] {
        let mut look = first.clone();
        (look.step, look.density) = (0.2, 3.0);
        look.clip.shares[0] = [0.5, 1.0];
        (look.clip.has_plane, look.clip.plane_yaw) = (true, 80.0);
        look.labels.selected = Some(9);
        let view: VolumeViewText = text.parse().unwrap();
        view.change(&mut look, &facts).unwrap();
        (look.orbit.target, look.centre) = (first.orbit.target, first.centre);
        assert_eq!(look, first, "{text}");
    }
    let camera = "volume:x=1,y=2,z=3,zoom=1,yaw=0,pitch=0";
    let view: VolumeViewText = format!("{camera};channel=0").parse().unwrap();
    let error = view.change(&mut first.clone(), &facts).unwrap_err().to_string();
    assert!(error.contains("a volume of labels"), "{error}");
}

#[test]
fn what_is_written_is_read() {
    let facts = facts();
    let mut look = VolumeLook::first(&facts);
    for range in [[5.0, 5.0], [f64::NEG_INFINITY, 1.0], [0.0, f64::INFINITY], [f64::NAN, f64::NAN]] {
        look.channels[0].range = Some(range);
        let text = VolumeViewText::of(&look, &facts).to_string();
        assert!(text.parse::<VolumeViewText>().is_ok(), "{text}");
    }
}
