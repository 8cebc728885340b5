!> The table `scenes`: which method for which scene. Every method does the same work to the same accuracy,
!> with as few steps as it can; the fastest wins.
module frb_chart_scenes
    use frb, only: wp
    use frb_chart_methods, only: method, catalogue, family_batch, family_momentum, family_dp, &
        family_dmv, family_flow, family_frames
    use frb_chart_output, only: chart_file, settings, open_table, quantile, say
    use frb_chart_timing, only: workload, new_workload, time_in_turn
    use frb_chart_truth, only: free_case, new_case, errors_of
    implicit none
    private

    public :: chart_scenes

    type :: scene
        character(24) :: name = ''
        real(wp) :: moments(3) = 1.0_wp
        real(wp) :: m0(3) = 0.0_wp
        real(wp) :: t = 1.0_wp
        real(wp) :: bound = 0.0_wp      !! error allowed at t: attitude [rad], or momentum over its norm
        integer :: steps = 0            !! number of steps the scene itself asks for; 0: the method's choice
        integer :: bodies = 1
        logical :: momentum_only = .false.
    end type scene

    !> A method that plays a scene.
    type :: attempt
        character(12) :: key = ''
        integer :: steps = 0
        real(wp) :: error = 0.0_wp
    end type attempt

contains

    !> All scenes. Each table row: scene, method, steps, time, error; the winner of a scene comes first.
    subroutine chart_scenes(options)
        type(settings), intent(in) :: options
        type(scene), allocatable :: scenes(:)
        type(workload), allocatable :: works(:)
        type(attempt), allocatable :: attempts(:)
        real(wp), allocatable :: ns(:, :)
        integer, allocatable :: last(:)
        type(chart_file) :: file
        integer :: s, n

        allocate (scenes, source=all_scenes())
        allocate (works(size(scenes)*size(catalogue())))
        allocate (attempts(size(works)), last(0:size(scenes)))
        n = 0
        last(0) = 0
        do s = 1, size(scenes)
            call add_attempts(scenes(s), works, attempts, n)
            last(s) = n
        end do
        allocate (ns(n, merge(5, 9, options%quick)))
        call time_in_turn(options, 'scenes', works(:n), merge(0.5e-3_wp, 2.0e-3_wp, options%quick), &
                          merge(2, 8, options%quick), ns)
        call open_table(options, 'scenes', &
            'time each method needs for a scene, in as few steps as the bound on '// &
            'the error allows; fastest first', &
            'scene, method, steps, time per body [ns]: median, quartiles; '// &
            'error (attitude [rad], or of the momentum over its norm); bound', file)
        do s = 1, size(scenes)
            associate (from => last(s - 1) + 1, to => last(s))
                call write_rows(file, scenes(s), attempts(from:to), ns(from:to, :))
            end associate
        end do
        call file%finish()
    end subroutine chart_scenes

    pure function all_scenes() result(scenes)
        type(scene), allocatable :: scenes(:)
        real(wp), parameter :: m(3) = [0.5_wp, 0.6_wp, 0.7_wp]
        real(wp), parameter :: general(3) = [1.0_wp, 1.5_wp, 2.0_wp]
        real(wp), parameter :: tight = 1.0e-13_wp

        allocate (scenes, source=[ &
            scene('sphere', [1.0_wp, 1.0_wp, 1.0_wp], m, 1.0_wp, tight), &
            scene('symmetric', [1.0_wp, 1.0_wp, 2.0_wp], m, 1.0_wp, tight), &
            scene('general', general, m, 1.0_wp, tight), &
            scene('momentum-only', general, m, 1.0_wp, tight, momentum_only=.true.), &
            scene('short-steps', general, m, 1.0_wp, tight, steps=100), &
            scene('one-long-step', general, m, 1000.0_wp, 1.0e-10_wp), &
            scene('separatrix', [2.0_wp, 3.0_wp, 6.0_wp], [0.5_wp*(1 + 1.0e-8_wp), 0.6_wp, 0.5_wp], 10.0_wp, &
                  1.0e-12_wp), &
            scene('many-bodies', general, m, 1.0_wp, tight, steps=10, bodies=10000), &
            scene('loose-tolerance', general, m, 1.0_wp, 1.0e-3_wp), &
            scene('loose-short-steps', general, m, 1.0_wp, 1.0e-3_wp, steps=100)])
    end function all_scenes

    !> Adds every method that can play the scene, with its workload.
    subroutine add_attempts(what, works, attempts, n)
        type(scene), intent(in) :: what
        type(workload), intent(inout) :: works(:)
        type(attempt), intent(inout) :: attempts(:)
        integer, intent(inout) :: n             !! number of works and attempts so far
        type(method), allocatable :: methods(:)
        type(free_case) :: item
        real(wp) :: error
        integer :: i, steps

        allocate (methods, source=catalogue())
        item = new_case(what%moments, what%m0, what%t)
        do i = 1, size(methods)
            if (methods(i)%family == family_momentum .and. .not. what%momentum_only) cycle
            if (methods(i)%family == family_frames) cycle
            if (what%bodies > 1 .and. all(methods(i)%family /= [family_batch, family_flow, family_dmv])) cycle
            if (what%bodies == 1 .and. methods(i)%family == family_batch) cycle
            if (methods(i)%family == family_dp .and. what%steps > 0) cycle
            call fewest_steps(methods(i), what, item, steps, error)
            if (steps == 0) cycle
            n = n + 1
            attempts(n) = attempt(methods(i)%key, steps, error)
            works(n) = new_workload(methods(i), what%moments, what%m0, what%t/steps, what%bodies)
            works(n)%nsteps = steps
        end do
    end subroutine add_attempts

    !> The rows of a scene, the fastest first.
    subroutine write_rows(file, what, attempts, ns)
        type(chart_file), intent(inout) :: file
        type(scene), intent(in) :: what
        type(attempt), intent(in) :: attempts(:)
        real(wp), intent(in) :: ns(:, :)
        real(wp) :: times(3, size(attempts))
        logical :: done(size(attempts))
        character(160) :: line
        integer :: i, place, row

        do i = 1, size(attempts)
            times(:, i) = attempts(i)%steps*[quantile(ns(i, :), 0.5_wp), quantile(ns(i, :), 0.25_wp), &
                quantile(ns(i, :), 0.75_wp)]
        end do
        done = .false.
        do row = 1, size(attempts)
            place = minloc(times(1, :), dim=1, mask=.not. done)
            done(place) = .true.
            write (line, '(a20,a14,i8,3es12.4,2es10.2)') what%name, attempts(place)%key, &
                attempts(place)%steps, times(:, place), attempts(place)%error, what%bound
            call file%put(trim(line))
            if (row == 1) call say('  '//trim(line(:54)))
        end do
    end subroutine write_rows

    !> The fewest steps, of 1, 2, 4, ..., with which the method stays within the bound. A scene with a number
    !> of steps allows this number only. 0 if the method does not stay within the bound.
    subroutine fewest_steps(with, what, item, steps, error)
        type(method), intent(in) :: with
        type(scene), intent(in) :: what
        type(free_case), intent(in) :: item
        integer, intent(out) :: steps
        real(wp), intent(out) :: error
        real(wp) :: error_m, error_q
        integer :: k, n

        steps = 0
        error = huge(1.0_wp)
        do k = 0, 15
            n = 2**k
            if (what%steps > 0) n = what%steps
            call errors_of(with, item, n, error_m, error_q)
            error = error_q
            if (what%momentum_only) error = error_m/norm2(what%m0)
            if (error <= what%bound) then
                steps = n
                return
            end if
            if (what%steps > 0 .or. with%family == family_dp) return
        end do
    end subroutine fewest_steps

end module frb_chart_scenes
