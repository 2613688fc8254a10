use nalgebra::Isometry3;

use crate::descent::pose_block;
use crate::normal_equations::NormalEquations;
use crate::view::View;

/// The views of one plane or landmark, prepared for the solver.
#[derive(Debug, Clone)]
struct Track<V> {
    /// Number of the plane or landmark among those that were added.
    number: usize,
    views: Vec<V>,
}

/// The planes, or the landmarks, of a graph.
#[derive(Debug, Clone)]
pub(crate) struct Tracks<V> {
    /// Those that more than one pose has seen.
    several: Vec<Track<V>>,
    /// Number of all that were added.
    added: usize,
}

/// Weights of views, by track and view.
pub(crate) type ViewWeights = Vec<Vec<f64>>;

impl<V> Default for Tracks<V> {
    fn default() -> Self {
        Self { several: Vec::new(), added: 0 }
    }
}

impl<V> Tracks<V> {
    /// Number of those that more than one pose has seen.
    pub(crate) fn len(&self) -> usize {
        self.several.len()
    }

    pub(crate) fn full_weights(&self) -> ViewWeights {
        self.several.iter().map(|track| vec![1.0; track.views.len()]).collect()
    }

    /// Sets the weights of the views to 0 that a solution has left out.
    pub(crate) fn leave_out(&self, weights: &mut ViewWeights, left_out: &[[usize; 2]]) {
        for (track, weights) in self.several.iter().zip(weights) {
            for (view, weight) in weights.iter_mut().enumerate() {
                if left_out.binary_search(&[track.number, view]).is_ok() {
                    *weight = 0.0;
                }
            }
        }
    }

    /// The views that have little weight: thing and view, by their numbers, ascending.
    pub(crate) fn left_out(&self, weights: &ViewWeights) -> Vec<[usize; 2]> {
        let views = self.several.iter().zip(weights).flat_map(|(track, weights)| {
            weights.iter().enumerate().map(|(view, weight)| ([track.number, view], *weight))
        });
        views.filter(|(_, weight)| *weight < 0.5).map(|(view, _)| view).collect()
    }

    /// Adds one by its views. What a single pose has seen says nothing.
    pub(crate) fn add<const R: usize>(&mut self, views: Vec<V>)
    where
        V: View<R>,
    {
        let number = self.added;
        self.added += 1;
        let first = views.first().map(V::pose);
        if views.iter().any(|view| Some(view.pose()) != first) {
            self.several.push(Track { number, views });
        }
    }

    /// The things that are best at these poses.
    pub(crate) fn best<const R: usize>(
        &self,
        poses: &[Isometry3<f64>],
        weights: &ViewWeights,
    ) -> Option<Vec<V::Thing>>
    where
        V: View<R>,
    {
        self.several
            .iter()
            .zip(weights)
            .map(|(track, weights)| V::best(&track.views, poses, weights))
            .collect()
    }

    /// The squared errors of all views, track by track.
    pub(crate) fn squared_errors<const R: usize>(
        &self,
        poses: &[Isometry3<f64>],
        things: &[V::Thing],
    ) -> impl Iterator<Item = f64>
    where
        V: View<R>,
    {
        self.several.iter().zip(things).flat_map(move |(track, thing)| {
            track.views.iter().map(move |view| view.error(&poses[view.pose()], thing).norm_squared())
        })
    }

    /// The pairs of blocks that views couple; `first`: the block of the first thing, which the others follow.
    pub(crate) fn coupled<const R: usize>(&self, first: usize) -> impl Iterator<Item = (usize, usize)>
    where
        V: View<R>,
    {
        self.several.iter().zip(first..).flat_map(|(track, own)| {
            track.views.iter().filter_map(move |view| Some((pose_block(view.pose())?, own)))
        })
    }

    /// Adds the views to the equations.
    pub(crate) fn linearize<const R: usize>(
        &self,
        poses: &[Isometry3<f64>],
        things: &[V::Thing],
        weights: &ViewWeights,
        first: usize,
        equations: &mut NormalEquations,
    ) where
        V: View<R>,
    {
        for (((track, thing), weights), own) in self.several.iter().zip(things).zip(weights).zip(first..) {
            for (view, weight) in track.views.iter().zip(weights) {
                let (error, by_pose, by_thing) = view.linearized(&poses[view.pose()], thing);
                let root = weight.sqrt();
                let (error, by_pose, by_thing) = (error * root, by_pose * root, by_thing * root);
                equations.subtract(own, &(by_thing.transpose() * error));
                equations.add([own; 2], &(by_thing.transpose() * by_thing));
                if let Some(block) = pose_block(view.pose()) {
                    equations.subtract(block, &(by_pose.transpose() * error));
                    equations.add([block; 2], &(by_pose.transpose() * by_pose));
                    equations.add([own, block], &(by_thing.transpose() * by_pose));
                }
            }
        }
    }
}
