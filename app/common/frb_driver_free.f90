!> Examples 0, 2, 3 and 4 of the paper: a free rigid body, attitude a matrix by `frb_step` (0 and 3) or a
!> quaternion by `quat_step` (2 and 4), in one step (0 and 2) or in many, exact or with np Gauss points.
!> Records are m(3), Q(9) or q(4), and t, at the start and after every step.
module frb_driver_free
    use frb, only: wp, frb_step, quat_step, status_ok, status_message
    use frb_driver_command, only: begin_run, fail_run, read_command, run_command
    use frb_driver_watch, only: run_watch
    use frb_init_files, only: init_values
    use frb_out_files, only: out_file
    implicit none
    private

    public :: run_free_body

contains

    !> Runs an example.
    subroutine run_free_body(example)
        integer, intent(in) :: example      !! 0, 2, 3 or 4
        type(run_command) :: command
        type(init_values) :: start
        type(out_file) :: out
        type(run_watch) :: watch
        character(:), allocatable :: error
        real(wp) :: m(3), attitude(3, 3), q(4)
        logical :: by_matrix
        integer :: i, stat

        by_matrix = example == 0 .or. example == 3
        call read_command(example, command)
        call begin_run(example, command, start, out)
        m = start%m
        attitude = start%attitude
        q = start%q
        call watch%begin(start%steps)
        call record(0)
        do i = 1, start%steps
            call watch%begin_step()
            if (by_matrix) then
                call frb_step(m, attitude, start%h, start%moments, m, attitude, np=start%points, stat=stat)
            else
                call quat_step(m, q, start%h, start%moments, m, q, np=start%points, stat=stat)
            end if
            call watch%end_step()
            if (stat /= status_ok) call fail_run(out, 'the step: '//status_message(stat))
            call record(i)
        end do
        call watch%finish('driver_example'//achar(iachar('0') + example)//': free rigid body, '// &
                          trim(merge('matrix    ', 'quaternion', by_matrix)), start%h, out)

    contains

        !> Notes and writes the state after step i.
        subroutine record(i)
            integer, intent(in) :: i
            real(wp) :: t

            t = (real(i, wp)/start%steps)*start%t_final
            if (by_matrix) then
                call watch%note(m, attitude, start%moments)
                call out%write_record([m, reshape(attitude, [9]), t], error)
            else
                call watch%note(m, q, start%moments)
                call out%write_record([m, q, t], error)
            end if
            if (allocated(error)) call fail_run(out, error)
        end subroutine record

    end subroutine run_free_body

end module frb_driver_free
